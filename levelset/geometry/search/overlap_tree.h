#pragma once

#include <Imath/ImathVec.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "levelset/geometry/search/overlap_builder.h"

// For the .cpp files of this library only.

namespace levelset {

/// Result of a search.
struct FoundItem {
  double squared = std::numeric_limits<double>::infinity();  ///< squared distance
  std::uint32_t index = 0xffffffffu;                         ///< number of the item

  [[nodiscard]] bool isValid() const { return index != 0xffffffffu; }
};

/// Order of results: by distance, then by number.
[[nodiscard]] inline bool operator<(const FoundItem& a, const FoundItem& b) {
  return a.squared != b.squared ? a.squared < b.squared : a.index < b.index;
}

/// Binary tree for searches of the closest items. Each item lies in one child of a node only, so
/// siblings may overlap [Sigg06, 4.1]. A node stores the tight boxes of both children. Splitting
/// planes instead would give poor lower bounds of the distance to a flat surface.
///
/// The distance to a cell is computed from its distances along the axes, in the order of the
/// distance to a point. So rounding cannot put it above the distance of a point in the cell.
/// Results therefore do not depend on the structure of the tree: the lowest number wins among
/// points at equal distance. Among triangles, this holds but for the rounding of their closest
/// points.
///
/// @tparam Item  has the members that OverlapBuilder needs, and squaredDistance(V3d) for all
/// searches but visit()
template <class Item>
class OverlapTree {
 public:
  OverlapTree() = default;
  /// Builds the tree in parallel, with the same bits for any number of threads.
  /// @param items  fewer than 2²⁹
  explicit OverlapTree(std::vector<Item> items) : items_(std::move(items)) {
    nodes_ = OverlapBuilder<Item>(items_).build();
  }

  [[nodiscard]] std::size_t size() const { return items_.size(); }
  [[nodiscard]] bool isEmpty() const { return items_.empty(); }
  /// Items in the order of the tree. Items near each other in this order are near each other in
  /// space.
  [[nodiscard]] const std::vector<Item>& items() const { return items_; }
  /// Gives each item the number of its place in items().
  void renumber() {
    for (std::size_t i = 0; i < items_.size(); ++i) items_[i].index = static_cast<std::uint32_t>(i);
  }
  /// Estimated memory while the tree is built, bytes for each item.
  [[nodiscard]] static constexpr double bytesPerItem() {
    return OverlapBuilder<Item>::bytesPerItem();
  }
  [[nodiscard]] std::size_t memoryUse() const {
    return items_.capacity() * sizeof(Item) + nodes_.capacity() * sizeof(Node);
  }

  /// Finds the closest item whose squared distance is below `squaredLimit`.
  [[nodiscard]] FoundItem closest(const Imath::V3d& from, double squaredLimit) const {
    return closestItem(from, squaredLimit).first;
  }

  /// Finds the closest item whose squared distance is below `squaredLimit`, and the item itself;
  /// null if there is none.
  [[nodiscard]] std::pair<FoundItem, const Item*> closestItem(const Imath::V3d& from,
                                                              double squaredLimit) const {
    FoundItem best{squaredLimit, 0xffffffffu};
    const Item* item = nullptr;
    search(
        from, [&] { return best.squared; },
        [&](const Item* begin, const Item* end, bool isSame) {
          // Items at one place are sorted by number.
          if (isSame) end = begin + 1;
          for (; begin != end; ++begin) {
            const FoundItem found{begin->squaredDistance(from), begin->index};
            // An item exactly at the limit does not count.
            if (!(found < best) || !(found.squared < squaredLimit)) continue;
            best = found;
            item = begin;
          }
        });
    return {best, item};
  }

  /// Finds the `count` closest items, nearest first; fewer if the tree has fewer.
  void closest(const Imath::V3d& from, std::size_t count, std::vector<FoundItem>& found) const {
    found.clear();
    if (count == 0) return;
    search(
        from,
        [&] {
          return found.size() < count ? std::numeric_limits<double>::infinity()
                                      : found.front().squared;
        },
        [&](const Item* begin, const Item* end, bool isSame) {
          if (isSame && static_cast<std::size_t>(end - begin) > count) end = begin + count;
          for (; begin != end; ++begin) {
            const FoundItem next{begin->squaredDistance(from), begin->index};
            if (found.size() < count) {
              found.push_back(next);
              std::push_heap(found.begin(), found.end());
            } else if (next < found.front()) {
              replaceFront(found, next);
            }
          }
        });
    std::sort_heap(found.begin(), found.end());
  }

  /// Finds all items whose squared distance is at most `squaredRadius`, sorted by number.
  void within(const Imath::V3d& from, double squaredRadius, std::vector<FoundItem>& found) const {
    found.clear();
    search(
        from, [&] { return squaredRadius; },
        [&](const Item* begin, const Item* end, bool) {
          for (; begin != end; ++begin) {
            const double squared = begin->squaredDistance(from);
            if (squared <= squaredRadius) found.push_back({squared, begin->index});
          }
        });
    std::sort(found.begin(), found.end(),
              [](const FoundItem& a, const FoundItem& b) { return a.index < b.index; });
  }

  /// Calls look(item) for each item whose box is at most √`squared` away from `from`, roughly near
  /// ones first. `look` may lower `squared` when it finds a nearer item.
  template <class Look>
  void visit(const Imath::V3d& from, const double& squared, const Look& look) const {
    search(
        from, [&] { return squared; },
        [&](const Item* begin, const Item* end, bool) {
          for (; begin != end; ++begin)
            if (begin->box().squaredDistance(from) <= squared) look(*begin);
        });
  }

 private:
  using Node = OverlapNode<typename Item::Number>;
  /// Upper bound of the depth: at most 2³² items, of which three quarters go to one child.
  static constexpr std::size_t kMaxDepth = 96;

  /// Cell that is still to be searched.
  struct Cell {
    const Node* node;
    double squared;  ///< squared distance from the query
  };

  /// Replaces the front of a heap and restores the order.
  static void replaceFront(std::vector<FoundItem>& heap, const FoundItem& next) {
    std::size_t at = 0;
    const std::size_t count = heap.size();
    for (std::size_t child = 1; child < count; child = 2 * at + 1) {
      if (child + 1 < count && heap[child] < heap[child + 1]) ++child;
      if (!(next < heap[child])) break;
      heap[at] = heap[child];
      at = child;
    }
    heap[at] = next;
  }

  /// Calls look(begin, end, isSame) for the leaves whose squared distance is at most limit(), near
  /// ones first.
  template <class Limit, class Look>
  void search(const Imath::V3d& from, const Limit& limit, const Look& look) const {
    if (nodes_.empty()) return;
    std::array<Cell, kMaxDepth> stack;
    std::size_t depth = 0;
    Cell cell{nodes_.data(), 0};
    while (true) {
      if (cell.squared <= limit()) {
        const Node& node = *cell.node;
        if (node.isLeaf()) {
          const Item* begin = items_.data() + node.at;
          look(begin, begin + node.count(), node.isSameLeaf());
        } else {
          const auto& [low, high] = node.boxes;
          const Cell first{cell.node + 1, low.squaredDistance(from)},
              second{cell.node + node.at, high.squaredDistance(from)};
          // Where both contain the query, the one that reaches farther beyond it comes first.
          const int axis = node.axis();
          const bool isFirst = first.squared != second.squared
                                   ? first.squared < second.squared
                                   : static_cast<double>(low.high[axis]) - from[axis] >=
                                         from[axis] - static_cast<double>(high.low[axis]);
          stack[depth++] = isFirst ? second : first;
          cell = isFirst ? first : second;
          continue;
        }
      }
      if (depth == 0) return;
      cell = stack[--depth];
    }
  }

  std::vector<Item> items_;
  std::vector<Node> nodes_;
};

}  // namespace levelset
