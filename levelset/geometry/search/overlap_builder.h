#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

#include "levelset/geometry/search/item_box.h"

// For overlap_tree.h only.

namespace levelset {

/// Node of an OverlapTree.
template <typename Number>
struct OverlapNode {
  static constexpr std::uint32_t kLeaf = 3, kSameLeaf = 4;

  std::array<ItemBox<Number>, 2> boxes;  ///< boxes of the children
  /// Axis of the split, or kLeaf or kSameLeaf; above its three bits the number of items of a leaf.
  std::uint32_t kindAndCount = kLeaf;
  /// Inner node: number of nodes from here to the second child; the first child comes next.
  /// Leaf: number of its first item.
  std::uint32_t at = 0;

  [[nodiscard]] bool isLeaf() const { return (kindAndCount & 7) >= kLeaf; }
  /// Returns true for a leaf of items at one place.
  [[nodiscard]] bool isSameLeaf() const { return (kindAndCount & 7) == kSameLeaf; }
  [[nodiscard]] int axis() const { return static_cast<int>(kindAndCount & 7); }
  [[nodiscard]] std::uint32_t count() const { return kindAndCount >> 3; }
};

/// Sorts items into the order of an OverlapTree and makes its nodes.
///
/// Items are distributed by the median of their centres, along the axis where the centres spread
/// most. Near the median, the items whose boxes cross its plane are moved between the children
/// until a query is expected to visit the fewest items. At most three quarters of the items go to
/// one child, so the depth is below 2.5 log₂ n.
///
/// @tparam Item  has the type Number of its coordinates (float or double), kHasExtent (false: its
/// box is a point), box(), centre(axis) (that of its box), `index`, and isSameAs(Item) for items at
/// one place
template <class Item>
class OverlapBuilder {
 public:
  using Number = typename Item::Number;
  using Box = ItemBox<Number>;
  using Node = OverlapNode<Number>;

  /// @param items  fewer than 2²⁹
  explicit OverlapBuilder(std::vector<Item>& items) : items_(items) {}

  /// Returns the nodes in depth-first order and sorts the items. Works in parallel, with the same
  /// bits for any number of threads.
  [[nodiscard]] std::vector<Node> build() {
    std::vector<Node> nodes;
    if (items_.empty()) return nodes;
    if constexpr (kMovesItems) {
      nodes = build(items_, 0, items_.size(), boxOf(items_, 0, items_.size()));
    } else {
      std::vector<Entry> entries(items_.size());
      forEach(items_.size(), [&](std::size_t i) {
        entries[i] = {items_[i].box(), items_[i].index, static_cast<std::uint32_t>(i)};
      });
      nodes = build(entries, 0, entries.size(), boxOf(entries, 0, entries.size()));
      std::vector<Item> sorted(items_.size());
      forEach(items_.size(), [&](std::size_t i) { sorted[i] = items_[entries[i].place]; });
      items_.swap(sorted);
    }
    nodes.shrink_to_fit();
    return nodes;
  }

  /// Estimated memory while the tree is built, bytes for each item: an item, its copies while it is
  /// sorted, and at most half a node twice, since nodes of subtrees are copied.
  [[nodiscard]] static constexpr double bytesPerItem() {
    return sizeof(Item) + sizeof(Node) + (kMovesItems ? 0.0 : sizeof(Item) + sizeof(Entry));
  }

 private:
  /// Box of a large item, with its number and its place in the list: cheaper to compare and to move
  /// than the item.
  struct Entry {
    Box bounds;
    std::uint32_t index, place;

    [[nodiscard]] const Box& box() const { return bounds; }
    [[nodiscard]] Number centre(int axis) const { return bounds.centre(axis); }
  };
  static constexpr bool kMovesItems = sizeof(Item) <= sizeof(Entry);
  using Element = std::conditional_t<kMovesItems, Item, Entry>;
  using List = std::vector<Element>;

  static constexpr std::size_t kItemsPerLeaf = 8;
  static constexpr std::size_t kItemsPerTask = 8192;

  template <class Work>
  static void forEach(std::size_t count, const Work& work) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, kItemsPerTask),
                      [&](const auto& range) {
                        for (std::size_t i = range.begin(); i != range.end(); ++i) work(i);
                      });
  }

  static Box boxOf(const List& list, std::size_t begin, std::size_t end) {
    Box box = list[begin].box();
    for (std::size_t i = begin + 1; i < end; ++i) box.extendBy(list[i].box());
    return box;
  }

  /// Axis along which the centres of the items spread most.
  /// @param box  of the items
  static int widestAxis(const List& list, std::size_t begin, std::size_t end, const Box& box) {
    auto size = box.high - box.low;
    if constexpr (Item::kHasExtent) {
      Box centres = list[begin].box();
      centres.low = centres.high = centres.low + centres.high;
      for (std::size_t i = begin + 1; i < end; ++i) {
        const auto at = list[i].box().low + list[i].box().high;
        centres.extendBy({at, at});
      }
      size = centres.high - centres.low;
    }
    return size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  }

  static auto place(List& list, std::size_t i) {
    return list.begin() + static_cast<std::ptrdiff_t>(i);
  }

  template <int kAxis>
  static void sortByMedian(List& list, std::size_t begin, std::size_t middle, std::size_t end) {
    std::nth_element(place(list, begin), place(list, middle), place(list, end),
                     [](const Element& a, const Element& b) {
                       const Number first = a.centre(kAxis), second = b.centre(kAxis);
                       return first != second ? first < second : a.index < b.index;
                     });
  }
  static void sortByMedian(List& list, std::size_t begin, std::size_t middle, std::size_t end,
                           int axis) {
    if (axis == 0)
      sortByMedian<0>(list, begin, middle, end);
    else if (axis == 1)
      sortByMedian<1>(list, begin, middle, end);
    else
      sortByMedian<2>(list, begin, middle, end);
  }

  /// Nodes of a subtree, in depth-first order. @param box  of its items
  std::vector<Node> build(List& list, std::size_t begin, std::size_t end, const Box& box) const {
    std::vector<Node> nodes;
    if (end - begin < kItemsPerTask) {
      append(list, begin, end, box, nodes);
      return nodes;
    }
    Node node;
    const std::size_t middle = split(list, begin, end, box, node);
    if (middle == end) return {node};
    std::vector<Node> first, second;
    tbb::parallel_invoke([&] { first = build(list, begin, middle, node.boxes[0]); },
                         [&] { second = build(list, middle, end, node.boxes[1]); });
    node.at = static_cast<std::uint32_t>(1 + first.size());
    nodes.reserve(1 + first.size() + second.size());
    nodes.push_back(node);
    nodes.insert(nodes.end(), first.begin(), first.end());
    nodes.insert(nodes.end(), second.begin(), second.end());
    return nodes;
  }

  void append(List& list, std::size_t begin, std::size_t end, const Box& box,
              std::vector<Node>& nodes) const {
    const std::size_t at = nodes.size();
    Node node;
    const std::size_t middle = split(list, begin, end, box, node);
    nodes.push_back(node);
    if (middle == end) return;
    append(list, begin, middle, node.boxes[0], nodes);
    nodes[at].at = static_cast<std::uint32_t>(nodes.size() - at);
    append(list, middle, end, node.boxes[1], nodes);
  }

  /// Distributes items to two children and sets their boxes. Returns the end of the first child's
  /// items, or `end` for a leaf. @param box  of the items
  std::size_t split(List& list, std::size_t begin, std::size_t end, const Box& box,
                    Node& node) const {
    const std::size_t count = end - begin;
    const bool isSmall = count <= kItemsPerLeaf;
    if (isSmall || areSame(list, begin, end)) {
      node.kindAndCount =
          static_cast<std::uint32_t>(count) << 3 | (isSmall ? Node::kLeaf : Node::kSameLeaf);
      node.at = static_cast<std::uint32_t>(begin);
      if (!isSmall)
        std::sort(place(list, begin), place(list, end),
                  [](const Element& a, const Element& b) { return a.index < b.index; });
      return end;
    }
    const int axis = widestAxis(list, begin, end, box);
    std::size_t middle = begin + count / 2;
    sortByMedian(list, begin, middle, end, axis);
    if constexpr (Item::kHasExtent) middle = sweep(list, begin, end, middle, axis);
    node.kindAndCount = static_cast<std::uint32_t>(axis);
    node.boxes = {boxOf(list, begin, middle), boxOf(list, middle, end)};
    return middle;
  }

  /// Moves the border between the children to where a query is expected to visit the fewest items.
  /// Only the items that cross the plane of the median are moved [Sigg06, 4.1.2].
  static std::size_t sweep(List& list, std::size_t begin, std::size_t end, std::size_t middle,
                           int axis) {
    const Number plane = list[middle].centre(axis) / 2;
    const auto lower = std::partition(place(list, begin), place(list, end),
                                      [&](const Element& e) { return e.box().high[axis] < plane; });
    const auto upper = std::partition(lower, place(list, end),
                                      [&](const Element& e) { return e.box().low[axis] <= plane; });
    std::sort(lower, upper, [axis](const Element& a, const Element& b) {
      const Number x = a.box().low[axis], y = b.box().low[axis];
      return x != y ? x < y : a.index < b.index;
    });
    const auto from = static_cast<std::size_t>(lower - list.begin()),
               to = static_cast<std::size_t>(upper - list.begin());
    const std::size_t quarter = (end - begin) / 4,
                      lowest = std::max({from, begin + quarter, begin + 1}),
                      highest = std::min(to, end - std::max<std::size_t>(quarter, 1));
    if (lowest <= highest) return leastVisited(list, begin, end, lowest, highest, axis);
    // Too many items are on one side.
    sortByMedian(list, begin, middle, end, axis);
    return middle;
  }

  /// Border from `lowest` to `highest` with the least expected number of items behind the planes.
  static std::size_t leastVisited(const List& list, std::size_t begin, std::size_t end,
                                  std::size_t lowest, std::size_t highest, int axis) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    // Lower ends of the items from each border on.
    std::vector<double> lows(highest - lowest + 1, kInfinity);
    const auto low = [&](std::size_t i) { return static_cast<double>(list[i].box().low[axis]); };
    const auto high = [&](std::size_t i) { return static_cast<double>(list[i].box().high[axis]); };
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

  bool areSame(const List& list, std::size_t begin, std::size_t end) const {
    const Item& first = itemOf(list[begin]);
    for (std::size_t i = begin + 1; i < end; ++i)
      if (!first.isSameAs(itemOf(list[i]))) return false;
    return true;
  }
  const Item& itemOf(const Element& element) const {
    if constexpr (kMovesItems)
      return element;
    else
      return items_[element.place];
  }

  std::vector<Item>& items_;
};

}  // namespace levelset
