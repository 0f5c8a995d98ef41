#pragma once

// Private to the ray casters of Bézier volumes: the shared nodes of a tree.

#include <Imath/ImathVec.h>

#include <vector>

#include "render/bezier/shared_tree.h"
#include "render/bezier/tree_root.h"

namespace render {

struct SharedTree::Data {
  /// @param frame  half extents of the picture on the screen; 0 for a single ray
  Data(const BezierVolume& volume, const BezierView& view, const Imath::V2d& frame,
       const TreeOptions& options);

  [[nodiscard]] Roots rootsOf(std::vector<Imath::V2d> screens, TreeCounts* sums) const;
  /// Sorts the roots of all rays, and joins those that several nodes have found.
  [[nodiscard]] Roots finished(RayGroup& rays) const;

  TreeContext context;
  bool isPolynomial;            ///< nodes have four components, otherwise five
  std::vector<TreeNode> nodes;  ///< from front to back, with frames and proofs
  TreeCounts counts;

 private:
  template <int N>
  void build(const BezierVolume& volume, const Imath::V2d& frame, const TreeOptions& options);
  template <int N>
  void proveNode(TreeNode& node, const ComponentScale& scale) const;
  template <int N>
  [[nodiscard]] Roots find(std::vector<Imath::V2d> screens, TreeCounts* sums) const;
};

}  // namespace render
