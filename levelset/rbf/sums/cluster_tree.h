#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace levelset::rbf {

/// Squared distance between two boxes; 0 if they touch or overlap.
[[nodiscard]] double squaredGap(const Imath::Box3d& a, const Imath::Box3d& b);

/// A balanced binary tree of points with tight boxes. Each node is split across its longest side at
/// the median point. The tree does not copy the points; they must outlive it.
class ClusterTree {
 public:
  struct Node {
    std::uint32_t begin = 0, end = 0;  ///< range of the node's points in order()
    std::int32_t child = -1;           ///< index of the first of two adjacent children; −1: leaf
    Imath::Box3d box = {};
    [[nodiscard]] std::size_t count() const { return end - begin; }
    [[nodiscard]] bool isLeaf() const { return child < 0; }
  };

  /// Builds the tree.
  /// @param leafSize  maximum number of points in a leaf, ≥ 1
  /// @pre there is at least one point, and fewer than 2³¹
  ClusterTree(std::span<const Imath::V3d> points, std::size_t leafSize);

  /// Copy of the tree for the same points sorted by order(). The sorted points must outlive the
  /// copy.
  [[nodiscard]] ClusterTree inOrder(std::span<const Imath::V3d> orderedPoints) const;
  /// Nodes, parents before children, the root first.
  [[nodiscard]] std::span<const Node> nodes() const { return nodes_; }
  /// Indices of the points, leaf by leaf.
  [[nodiscard]] std::span<const std::uint32_t> order() const { return order_; }
  /// Index of the point nearest to the point with index `point`, the lower index in a tie; `point`
  /// itself if there is no other.
  [[nodiscard]] std::uint32_t nearest(std::uint32_t point) const;
  /// All points within `radius` of `center`, in the order of the tree.
  [[nodiscard]] std::vector<std::uint32_t> within(const Imath::V3d& center, double radius) const;
  /// The `count` points nearest to a box, by distance and then index; fewer if the tree has fewer.
  [[nodiscard]] std::vector<std::uint32_t> around(const Imath::Box3d& box, std::size_t count) const;

 private:
  void split(std::size_t node, std::size_t leafSize);

  std::span<const Imath::V3d> points_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace levelset::rbf
