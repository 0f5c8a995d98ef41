#pragma once

#include <tbb/parallel_invoke.h>

#include <Imath/ImathVec.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

// For the .cpp files of this library only.

namespace levelset::points {

/// Result of a search.
struct Found {
  double squared = std::numeric_limits<double>::infinity();  ///< squared distance, world units²
  std::uint32_t index = 0xffffffffu;                         ///< number of the item

  [[nodiscard]] bool isValid() const { return index != 0xffffffffu; }
};

/// Order of results: by distance, then by number.
[[nodiscard]] inline bool operator<(const Found& a, const Found& b) {
  return a.squared != b.squared ? a.squared < b.squared : a.index < b.index;
}

/// Box of an item.
struct ItemBox {
  Imath::V3d low, high;

  void extendBy(const ItemBox& other) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], other.low[axis]);
      high[axis] = std::max(high[axis], other.high[axis]);
    }
  }
  /// Distances along the axes from a point to the box.
  [[nodiscard]] Imath::V3d gap(const Imath::V3d& from) const {
    return {std::max({low.x - from.x, from.x - high.x, 0.0}),
            std::max({low.y - from.y, from.y - high.y, 0.0}),
            std::max({low.z - from.z, from.z - high.z, 0.0})};
  }
};

/// Bounds of two siblings by two planes across one axis: the upper end of the first one and the
/// lower end of the second one [Sigg06, 4.1.1]. Needs 16 bytes, but says nothing about the other
/// axes: a far query visits many nodes.
struct SiblingPlanes {
  double firstHigh = 0, secondLow = 0;

  void set(int axis, const ItemBox& first, const ItemBox& second) {
    firstHigh = first.high[axis];
    secondLow = second.low[axis];
  }
  /// Distances along the axes from a point to the siblings.
  /// @param gap  distances to the parent
  [[nodiscard]] std::array<Imath::V3d, 2> gaps(const Imath::V3d& from, const Imath::V3d& gap,
                                               int axis) const {
    std::array<Imath::V3d, 2> both{gap, gap};
    both[0][axis] = std::max(gap[axis], from[axis] - firstHigh);
    both[1][axis] = std::max(gap[axis], secondLow - from[axis]);
    return both;
  }
  [[nodiscard]] bool isFirstNearer(const Imath::V3d& from, int axis) const {
    return firstHigh - from[axis] >= from[axis] - secondLow;
  }
};

/// Bounds of two siblings by the tight boxes of their items.
struct SiblingBoxes {
  std::array<ItemBox, 2> boxes;

  void set(int, const ItemBox& first, const ItemBox& second) { boxes = {first, second}; }
  [[nodiscard]] std::array<Imath::V3d, 2> gaps(const Imath::V3d& from, const Imath::V3d&,
                                               int) const {
    return {boxes[0].gap(from), boxes[1].gap(from)};
  }
  [[nodiscard]] bool isFirstNearer(const Imath::V3d& from, int axis) const {
    return boxes[0].high[axis] - from[axis] >= from[axis] - boxes[1].low[axis];
  }
};

/// Binary tree for searches of the closest items. Each item lies in one child of a node only, so
/// siblings may overlap [Sigg06, 4.1]. A node stores bounds of both children: two planes or two
/// boxes.
///
/// Items are distributed by the median of their centres, along the axis where the centres spread
/// most. Near the median, the items whose boxes cross its plane are moved between the children
/// until a query is expected to visit the fewest items. At most three quarters of the items go to
/// one child, so the depth is below 2.5 log₂ n.
///
/// The distance to a cell is computed from its distances along the axes, in the order of the
/// distance to a point. So rounding cannot put it above the distance of a point in the cell.
/// Results therefore do not depend on the structure of the tree: the lowest number wins among
/// points at equal distance. Among triangles, this holds but for the rounding of their closest
/// points.
///
/// @tparam Item    has box(), squaredDistance(V3d), `index`, and isSameAs(Item) for items at one
/// place
/// @tparam Bounds  SiblingPlanes or SiblingBoxes
template <class Item, class Bounds>
class OverlapTree {
 public:
  OverlapTree() = default;
  /// Builds the tree in parallel, with the same bits for any number of threads.
  /// @param items  fewer than 2²⁹
  explicit OverlapTree(std::vector<Item> items) : items_(std::move(items)) {
    if (items_.empty()) return;
    box_ = boxOf(0, items_.size());
    nodes_ = build(0, items_.size());
    nodes_.shrink_to_fit();
  }

  [[nodiscard]] std::size_t size() const { return items_.size(); }
  /// Items in the order of the tree. Items near each other in this order are near each other in
  /// space.
  [[nodiscard]] const std::vector<Item>& items() const { return items_; }
  /// Gives each item the number of its place in items().
  void renumber() {
    for (std::size_t i = 0; i < items_.size(); ++i) items_[i].index = static_cast<std::uint32_t>(i);
  }
  /// Estimated memory while the tree is built, bytes for each item: an item, and at most half a
  /// node twice, since nodes of subtrees are copied.
  [[nodiscard]] static constexpr double bytesPerItem() { return sizeof(Item) + sizeof(Node); }
  [[nodiscard]] std::size_t memoryUse() const {
    return items_.capacity() * sizeof(Item) + nodes_.capacity() * sizeof(Node);
  }

  /// Finds the closest item whose squared distance is below `squaredLimit`.
  [[nodiscard]] Found closest(const Imath::V3d& from, double squaredLimit) const {
    Found best{squaredLimit, 0xffffffffu};
    search(
        from, [&] { return best.squared; },
        [&](const Item* begin, const Item* end, bool isSame) {
          // Items at one place are sorted by number.
          if (isSame) end = begin + 1;
          for (; begin != end; ++begin) {
            const Found found{begin->squaredDistance(from), begin->index};
            // An item exactly at the limit does not count.
            if (found < best && found.squared < squaredLimit) best = found;
          }
        });
    return best;
  }

  /// Finds the `count` closest items, nearest first; fewer if the tree has fewer.
  void closest(const Imath::V3d& from, std::size_t count, std::vector<Found>& found) const {
    found.clear();
    if (count == 0) return;
    // `found` is a heap with the farthest item in front.
    search(
        from,
        [&] {
          return found.size() < count ? std::numeric_limits<double>::infinity()
                                      : found.front().squared;
        },
        [&](const Item* begin, const Item* end, bool isSame) {
          if (isSame && static_cast<std::size_t>(end - begin) > count) end = begin + count;
          for (; begin != end; ++begin) {
            const Found next{begin->squaredDistance(from), begin->index};
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
  void within(const Imath::V3d& from, double squaredRadius, std::vector<Found>& found) const {
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
              [](const Found& a, const Found& b) { return a.index < b.index; });
  }

 private:
  static constexpr std::size_t kItemsPerLeaf = 8;
  static constexpr std::size_t kItemsPerTask = 8192;
  /// Upper bound of the depth: at most 2³² items, of which three quarters go to one child.
  static constexpr std::size_t kMaxDepth = 96;

  static constexpr std::uint32_t kLeaf = 3, kSameLeaf = 4;

  struct Node {
    Bounds bounds;
    /// Axis of the planes, or kLeaf or kSameLeaf; above its three bits the number of items of a
    /// leaf.
    std::uint32_t kindAndCount = kLeaf;
    /// Inner node: number of nodes from here to the second child; the first child comes next.
    /// Leaf: number of its first item.
    std::uint32_t at = 0;

    [[nodiscard]] std::uint32_t kind() const { return kindAndCount & 7; }
    [[nodiscard]] std::uint32_t count() const { return kindAndCount >> 3; }
  };

  /// Cell that is still to be searched: the distances along the axes from the query to it.
  struct Cell {
    const Node* node;
    Imath::V3d gap;
    double squared;
  };

  static double squaredLength(const Imath::V3d& v) { return v.x * v.x + v.y * v.y + v.z * v.z; }

  /// Replaces the front of a heap and restores the order.
  static void replaceFront(std::vector<Found>& heap, const Found& next) {
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
    const Imath::V3d gap = box_.gap(from);
    Cell cell{nodes_.data(), gap, squaredLength(gap)};
    while (true) {
      if (cell.squared <= limit()) {
        const Node& node = *cell.node;
        if (node.kind() >= kLeaf) {
          const Item* begin = items_.data() + node.at;
          look(begin, begin + node.count(), node.kind() == kSameLeaf);
        } else {
          const auto axis = static_cast<int>(node.kind());
          const auto gaps = node.bounds.gaps(from, cell.gap, axis);
          const Cell first{cell.node + 1, gaps[0], squaredLength(gaps[0])},
              second{cell.node + node.at, gaps[1], squaredLength(gaps[1])};
          // Where both contain the query, the one that reaches farther beyond it comes first.
          const bool isFirst = first.squared != second.squared
                                   ? first.squared < second.squared
                                   : node.bounds.isFirstNearer(from, axis);
          stack[depth++] = isFirst ? second : first;
          cell = isFirst ? first : second;
          continue;
        }
      }
      if (depth == 0) return;
      cell = stack[--depth];
    }
  }

  ItemBox boxOf(std::size_t begin, std::size_t end) const {
    ItemBox box = items_[begin].box();
    for (std::size_t i = begin + 1; i < end; ++i) box.extendBy(items_[i].box());
    return box;
  }

  /// Axis along which the centres of the items spread most.
  int widestAxis(std::size_t begin, std::size_t end) const {
    ItemBox centres = items_[begin].box();
    centres.low = centres.high = centres.low + centres.high;
    for (std::size_t i = begin + 1; i < end; ++i) {
      const ItemBox box = items_[i].box();
      const Imath::V3d at = box.low + box.high;
      centres.extendBy({at, at});
    }
    const Imath::V3d size = centres.high - centres.low;
    return size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  }

  auto item(std::size_t i) { return items_.begin() + static_cast<std::ptrdiff_t>(i); }

  static double centre(const Item& item, int axis) {
    const ItemBox box = item.box();
    return box.low[axis] + box.high[axis];
  }
  static bool isBefore(const Item& a, const Item& b, int axis) {
    const double first = centre(a, axis), second = centre(b, axis);
    return first != second ? first < second : a.index < b.index;
  }

  /// Nodes of a subtree, in depth-first order.
  std::vector<Node> build(std::size_t begin, std::size_t end) {
    std::vector<Node> nodes;
    if (end - begin < kItemsPerTask) {
      append(begin, end, nodes);
      return nodes;
    }
    Node node;
    const std::size_t middle = split(begin, end, node);
    if (middle == end) return {node};
    std::vector<Node> first, second;
    tbb::parallel_invoke([&] { first = build(begin, middle); },
                         [&] { second = build(middle, end); });
    node.at = static_cast<std::uint32_t>(1 + first.size());
    nodes.reserve(1 + first.size() + second.size());
    nodes.push_back(node);
    nodes.insert(nodes.end(), first.begin(), first.end());
    nodes.insert(nodes.end(), second.begin(), second.end());
    return nodes;
  }

  void append(std::size_t begin, std::size_t end, std::vector<Node>& nodes) {
    const std::size_t at = nodes.size();
    Node node;
    const std::size_t middle = split(begin, end, node);
    nodes.push_back(node);
    if (middle == end) return;
    append(begin, middle, nodes);
    nodes[at].at = static_cast<std::uint32_t>(nodes.size() - at);
    append(middle, end, nodes);
  }

  /// Distributes items to two children and sets their bounds. Returns the end of the first child's
  /// items, or `end` for a leaf.
  std::size_t split(std::size_t begin, std::size_t end, Node& node) {
    const std::size_t count = end - begin;
    const bool isSmall = count <= kItemsPerLeaf;
    if (isSmall || areSame(begin, end)) {
      node.kindAndCount =
          static_cast<std::uint32_t>(count) << 3 | (isSmall ? std::uint32_t{kLeaf} : kSameLeaf);
      node.at = static_cast<std::uint32_t>(begin);
      if (!isSmall)
        std::sort(item(begin), item(end),
                  [](const Item& a, const Item& b) { return a.index < b.index; });
      return end;
    }
    const int axis = widestAxis(begin, end);
    std::size_t middle = begin + count / 2;
    std::nth_element(item(begin), item(middle), item(end),
                     [axis](const Item& a, const Item& b) { return isBefore(a, b, axis); });
    if constexpr (Item::kHasExtent) middle = sweep(begin, end, middle, axis);
    node.kindAndCount = static_cast<std::uint32_t>(axis);
    node.bounds.set(axis, boxOf(begin, middle), boxOf(middle, end));
    return middle;
  }

  /// Moves the border between the children to where a query is expected to visit the fewest items.
  /// Only the items that cross the plane of the median are moved [Sigg06, 4.1.2].
  std::size_t sweep(std::size_t begin, std::size_t end, std::size_t middle, int axis) {
    const double plane = 0.5 * centre(items_[middle], axis);
    const auto lower = std::partition(item(begin), item(end),
                                      [&](const Item& i) { return i.box().high[axis] < plane; });
    const auto upper =
        std::partition(lower, item(end), [&](const Item& i) { return i.box().low[axis] <= plane; });
    std::sort(lower, upper, [axis](const Item& a, const Item& b) {
      const double x = a.box().low[axis], y = b.box().low[axis];
      return x != y ? x < y : a.index < b.index;
    });
    const auto from = static_cast<std::size_t>(lower - items_.begin()),
               to = static_cast<std::size_t>(upper - items_.begin());
    const std::size_t quarter = (end - begin) / 4,
                      lowest = std::max({from, begin + quarter, begin + 1}),
                      highest = std::min(to, end - std::max<std::size_t>(quarter, 1));
    if (lowest <= highest) return leastVisited(begin, end, lowest, highest, axis);
    // Too many items are on one side.
    std::nth_element(item(begin), item(middle), item(end),
                     [axis](const Item& a, const Item& b) { return isBefore(a, b, axis); });
    return middle;
  }

  /// Border from `lowest` to `highest` with the least expected number of items behind the planes.
  std::size_t leastVisited(std::size_t begin, std::size_t end, std::size_t lowest,
                           std::size_t highest, int axis) const {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    // Lower ends of the items from each border on.
    std::vector<double> lows(highest - lowest + 1, kInfinity);
    const auto low = [&](std::size_t i) { return items_[i].box().low[axis]; };
    const auto high = [&](std::size_t i) { return items_[i].box().high[axis]; };
    double top = -kInfinity, bottom = kInfinity, reached = -kInfinity;
    for (std::size_t i = begin; i < end; ++i) {
      top = std::max(top, high(i));
      bottom = std::min(bottom, low(i));
    }
    for (std::size_t i = end; i-- > lowest;) {
      double& at = lows[std::min(i, highest) - lowest];
      at = std::min({at, low(i), i < highest ? lows[i - lowest + 1] : kInfinity});
    }
    for (std::size_t i = begin; i < lowest; ++i) reached = std::max(reached, high(i));
    double least = kInfinity;
    std::size_t best = lowest;
    for (std::size_t i = lowest; i <= highest; ++i) {
      if (i > lowest) reached = std::max(reached, high(i - 1));
      const double visited = static_cast<double>(i - begin) * (reached - bottom) +
                             static_cast<double>(end - i) * (top - lows[i - lowest]);
      if (visited < least) {
        least = visited;
        best = i;
      }
    }
    return best;
  }

  bool areSame(std::size_t begin, std::size_t end) const {
    for (std::size_t i = begin + 1; i < end; ++i)
      if (!items_[begin].isSameAs(items_[i])) return false;
    return true;
  }

  std::vector<Item> items_;
  std::vector<Node> nodes_;
  ItemBox box_;
};

}  // namespace levelset::points
