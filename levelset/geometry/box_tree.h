#pragma once

// Includes OpenVDB, so include it from .cpp files only.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "levelset/vdb.h"

namespace levelset {

/// Binary tree of the bounding boxes of items, for nearest-item searches. Each node stores the
/// tight box of its items, not only a splitting plane: planes give poor lower bounds of the
/// distance to a flat surface.
class BoxTree {
 public:
  BoxTree() = default;
  /// @param bound  (item, low, high): extends the box from `low` to `high` by an item
  /// @param coordinate  (item, axis): coordinate by which an item is sorted to one side of a split
  template <typename Bound, typename Coordinate>
  BoxTree(std::size_t count, const Bound& bound, const Coordinate& coordinate) : order_(count) {
    std::iota(order_.begin(), order_.end(), 0u);
    if (count > 0) build(0, static_cast<std::uint32_t>(count), bound, coordinate);
  }

  /// Item numbers in the order of the leaves.
  [[nodiscard]] const std::vector<std::uint32_t>& order() const { return order_; }

  /// Calls look(begin, end) for each leaf whose box is at most √`squared` away from `from`, near
  /// leaves first. The items of the leaf are order()[begin] to order()[end − 1]. `look` lowers
  /// `squared` when it finds a nearer item.
  template <typename Look>
  void search(const openvdb::Vec3d& from, const double& squared, const Look& look) const {
    if (!nodes_.empty()) visit(0, from, squared, look);
  }

 private:
  static constexpr std::uint32_t kItemsPerLeaf = 4;

  struct Node {
    openvdb::Vec3f low, high;
    std::uint32_t begin = 0, end = 0;  ///< range in order_
    /// Index of the second child, 0 for a leaf; the first child follows its parent.
    std::uint32_t right = 0;
  };

  template <typename Bound, typename Coordinate>
  std::uint32_t build(std::uint32_t begin, std::uint32_t end, const Bound& bound,
                      const Coordinate& coordinate) {
    const auto index = static_cast<std::uint32_t>(nodes_.size());
    nodes_.emplace_back();
    openvdb::Vec3d low(std::numeric_limits<double>::max()), high = -low;
    for (std::uint32_t i = begin; i < end; ++i) bound(order_[i], low, high);
    // Rounds the box outwards to float, so that it contains its items.
    for (int i = 0; i < 3; ++i) {
      nodes_[index].low[i] = std::nextafter(static_cast<float>(low[i]), -INFINITY);
      nodes_[index].high[i] = std::nextafter(static_cast<float>(high[i]), INFINITY);
    }
    nodes_[index].begin = begin;
    nodes_[index].end = end;
    if (end - begin <= kItemsPerLeaf) return index;
    const openvdb::Vec3d size = high - low;
    const int axis = size[0] >= size[1] && size[0] >= size[2] ? 0 : size[1] >= size[2] ? 1 : 2;
    const std::uint32_t middle = begin + (end - begin) / 2;
    const auto at = [&](std::uint32_t i) { return order_.begin() + i; };
    std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
      return coordinate(a, axis) < coordinate(b, axis);
    });
    build(begin, middle, bound, coordinate);
    const std::uint32_t right = build(middle, end, bound, coordinate);
    nodes_[index].right = right;
    return index;
  }

  template <typename Look>
  void visit(std::uint32_t index, const openvdb::Vec3d& from, const double& squared,
             const Look& look) const {
    const Node& node = nodes_[index];
    if (!node.right) return look(node.begin, node.end);
    std::uint32_t near = index + 1, far = node.right;
    double first = squaredTo(nodes_[near], from), second = squaredTo(nodes_[far], from);
    if (second < first) {
      std::swap(near, far);
      std::swap(first, second);
    }
    if (first <= squared) visit(near, from, squared, look);
    if (second <= squared) visit(far, from, squared, look);
  }

  static double squaredTo(const Node& node, const openvdb::Vec3d& p) {
    double sum = 0;
    for (int i = 0; i < 3; ++i) {
      const double out = std::max(
          {static_cast<double>(node.low[i]) - p[i], p[i] - static_cast<double>(node.high[i]), 0.0});
      sum += out * out;
    }
    return sum;
  }

  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace levelset
