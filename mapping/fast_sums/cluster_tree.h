#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace mapping {

/// Distance of two boxes, squared; 0 where they touch.
[[nodiscard]] double squaredGap(const Imath::Box3d& a, const Imath::Box3d& b);

/// Points in a binary tree of tight boxes, halved across their longest side by the middle point, so
/// that it is balanced however the points lie. It refers to the points.
class PointTree {
 public:
  struct Node {
    std::uint32_t begin = 0, end = 0;  ///< of order()
    std::int32_t child = -1;           ///< the first of two in a row; −1: a leaf
    Imath::Box3d box = {};
    [[nodiscard]] std::size_t count() const { return end - begin; }
    [[nodiscard]] bool isLeaf() const { return child < 0; }
  };

  /// @param leafSize  points in a leaf at the most, ≥ 1
  /// @pre there is a point, and fewer than 2³¹
  PointTree(std::span<const Imath::V3d> points, std::size_t leafSize);

  /// The same tree of the same points once these lie in its order; it refers to those.
  [[nodiscard]] PointTree inOrder(std::span<const Imath::V3d> orderedPoints) const;
  /// Parents before children, the root first.
  [[nodiscard]] std::span<const Node> nodes() const { return nodes_; }
  /// Indices of the points, leaf after leaf.
  [[nodiscard]] std::span<const std::uint32_t> order() const { return order_; }
  /// The nearest other point, the lower index of two; `point` itself if there is no other.
  [[nodiscard]] std::uint32_t nearest(std::uint32_t point) const;
  /// All points no further than `radius` from `center`, in the order of the tree.
  [[nodiscard]] std::vector<std::uint32_t> within(const Imath::V3d& center, double radius) const;
  /// The `count` points nearest to a box, by distance and then index; fewer if there are no more.
  [[nodiscard]] std::vector<std::uint32_t> around(const Imath::Box3d& box, std::size_t count) const;

 private:
  void split(std::size_t node, std::size_t leafSize);

  std::span<const Imath::V3d> points_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace mapping
