#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace levelset {

/// Cell of a grid of cubes.
using GridCell = Imath::Vec3<std::int64_t>;

struct GridCellHash {
  std::size_t operator()(const GridCell& c) const {
    const auto bits = [](std::int64_t v) { return static_cast<std::uint64_t>(v); };
    return (bits(c.x) * 0x9e3779b97f4a7c15ull) ^ (bits(c.y) * 0xc2b2ae3d27d4eb4full) ^
           (bits(c.z) * 0x165667b19e3779f9ull);
  }
};

/// Numbers of items by the cell of a position. Deterministic.
class ItemGrid {
 public:
  /// @param cell  edge of a cell
  explicit ItemGrid(double cell) : cell_(cell) {}

  [[nodiscard]] GridCell cellOf(const Imath::V3d& p) const {
    return {static_cast<std::int64_t>(std::floor(p.x / cell_)),
            static_cast<std::int64_t>(std::floor(p.y / cell_)),
            static_cast<std::int64_t>(std::floor(p.z / cell_))};
  }
  void add(std::uint32_t item, const Imath::V3d& position) {
    cells_[cellOf(position)].push_back(item);
  }
  void remove(std::uint32_t item, const GridCell& cell) {
    const auto found = cells_.find(cell);
    std::erase(found->second, item);
    if (found->second.empty()) cells_.erase(found);
  }
  /// Calls visit(item) for the items of the cells around a position, at least those within
  /// `radius`, until it returns true. Returns true if it did.
  template <typename Visit>
  bool anyNear(const Imath::V3d& position, double radius, const Visit& visit) const {
    const GridCell low = cellOf(position - Imath::V3d(radius)),
                   high = cellOf(position + Imath::V3d(radius));
    // A large radius would visit more cells than there are.
    const GridCell size = high - low + GridCell(1);
    const double count =
        static_cast<double>(size.x) * static_cast<double>(size.y) * static_cast<double>(size.z);
    if (count > static_cast<double>(cells_.size())) {
      for (const auto& [at, items] : cells_)
        if (at.x >= low.x && at.x <= high.x && at.y >= low.y && at.y <= high.y && at.z >= low.z &&
            at.z <= high.z)
          for (const std::uint32_t item : items)
            if (visit(item)) return true;
      return false;
    }
    GridCell c;
    for (c.x = low.x; c.x <= high.x; ++c.x)
      for (c.y = low.y; c.y <= high.y; ++c.y)
        for (c.z = low.z; c.z <= high.z; ++c.z)
          if (const auto cell = cells_.find(c); cell != cells_.end())
            for (const std::uint32_t item : cell->second)
              if (visit(item)) return true;
    return false;
  }

 private:
  double cell_;
  std::unordered_map<GridCell, std::vector<std::uint32_t>, GridCellHash> cells_;
};

}  // namespace levelset
