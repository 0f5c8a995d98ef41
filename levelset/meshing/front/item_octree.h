#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace levelset {

/// Numbers of items by position, for items whose sizes differ by orders of magnitude. Each item
/// lies in a cell of about its size, so a search visits few cells and few items at any size. The
/// cells form octrees below the cells of a coarse grid. Deterministic.
class ItemOctree {
 public:
  /// @param cell  edge of the coarsest cells; at least the size of the largest items
  explicit ItemOctree(double cell) : cell_(cell) {}

  /// @param size  items of about this size are found in few steps
  void add(std::uint32_t item, const Imath::V3d& position, double size) {
    nodes_[nodeOf(position, size)].items.push_back(item);
  }
  /// @pre the item was added with this position and size
  void remove(std::uint32_t item, const Imath::V3d& position, double size) {
    std::erase(nodes_[nodeOf(position, size)].items, item);
  }
  /// Calls visit(item) for the items of the cells around a position, until it returns true: at
  /// least for those whose position is within `radius` and `share` of their size. Returns true if
  /// it did.
  template <typename Visit>
  bool anyNear(const Imath::V3d& position, double radius, double share, const Visit& visit) const {
    const Imath::V3d at = position / cell_;
    const double reach = radius / cell_;
    const Cell low = cellOf(at - Imath::V3d(reach + share)),
               high = cellOf(at + Imath::V3d(reach + share));
    const auto search = [&](const Cell& cell, std::uint32_t root) {
      const Imath::V3d middle(static_cast<double>(cell.x) + 0.5, static_cast<double>(cell.y) + 0.5,
                              static_cast<double>(cell.z) + 0.5);
      return anyIn(root, middle - at, 0.5, reach, share, visit);
    };
    // A large radius would visit more cells than there are.
    const Cell size = high - low + Cell(1);
    const double count =
        static_cast<double>(size.x) * static_cast<double>(size.y) * static_cast<double>(size.z);
    if (count > static_cast<double>(roots_.size())) {
      for (const auto& [cell, root] : roots_)
        if (search(cell, root)) return true;
      return false;
    }
    Cell cell;
    for (cell.x = low.x; cell.x <= high.x; ++cell.x)
      for (cell.y = low.y; cell.y <= high.y; ++cell.y)
        for (cell.z = low.z; cell.z <= high.z; ++cell.z)
          if (const auto root = roots_.find(cell); root != roots_.end())
            if (search(cell, root->second)) return true;
    return false;
  }

 private:
  using Cell = Imath::Vec3<std::int64_t>;
  struct CellHash {
    std::size_t operator()(const Cell& c) const {
      const auto bits = [](std::int64_t v) { return static_cast<std::uint64_t>(v); };
      return (bits(c.x) * 0x9e3779b97f4a7c15ull) ^ (bits(c.y) * 0xc2b2ae3d27d4eb4full) ^
             (bits(c.z) * 0x165667b19e3779f9ull);
    }
  };
  struct Node {
    std::array<std::uint32_t, 8> children{};  ///< 0: none, since no root is a child
    std::vector<std::uint32_t> items;
  };
  /// Deepest level below the roots. Smaller items share cells.
  static constexpr int kDeepest = 20;

  static Cell cellOf(const Imath::V3d& at) {
    return {static_cast<std::int64_t>(std::floor(at.x)),
            static_cast<std::int64_t>(std::floor(at.y)),
            static_cast<std::int64_t>(std::floor(at.z))};
  }
  /// Returns the cell of an item: the smallest one around its position that is not smaller.
  std::uint32_t nodeOf(const Imath::V3d& position, double size) {
    const Imath::V3d at = position / cell_;
    const Cell cell = cellOf(at);
    const auto [root, isNew] = roots_.try_emplace(cell, static_cast<std::uint32_t>(nodes_.size()));
    if (isNew) nodes_.emplace_back();
    std::uint32_t node = root->second;
    Imath::V3d share = at - Imath::V3d(static_cast<double>(cell.x), static_cast<double>(cell.y),
                                       static_cast<double>(cell.z));
    double edge = cell_ / 2;
    for (int level = 0; level < kDeepest && edge >= size; ++level, edge /= 2) {
      std::size_t child = 0;
      for (int axis = 0; axis < 3; ++axis) {
        share[axis] *= 2;
        if (share[axis] < 1) continue;
        share[axis] -= 1;
        child |= std::size_t{1} << axis;
      }
      if (nodes_[node].children[child] == 0) {
        nodes_[node].children[child] = static_cast<std::uint32_t>(nodes_.size());
        nodes_.emplace_back();
      }
      node = nodes_[node].children[child];
    }
    return node;
  }
  /// @param to    from the position of the search to the middle of the cell, coarsest cells
  /// @param half  half the edge of the cell
  template <typename Visit>
  bool anyIn(std::uint32_t node, const Imath::V3d& to, double half, double reach, double share,
             const Visit& visit) const {
    const double limit = half + reach + 2 * half * share;
    if (std::abs(to.x) > limit || std::abs(to.y) > limit || std::abs(to.z) > limit) return false;
    for (const std::uint32_t item : nodes_[node].items)
      if (visit(item)) return true;
    for (std::size_t child = 0; child < 8; ++child)
      if (const std::uint32_t next = nodes_[node].children[child]; next != 0) {
        const Imath::V3d step((child & 1) != 0 ? half : -half, (child & 2) != 0 ? half : -half,
                              (child & 4) != 0 ? half : -half);
        if (anyIn(next, to + step / 2, half / 2, reach, share, visit)) return true;
      }
    return false;
  }

  double cell_;
  std::unordered_map<Cell, std::uint32_t, CellHash> roots_;
  std::vector<Node> nodes_;
};

}  // namespace levelset
