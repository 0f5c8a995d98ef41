#pragma once

// For the .cpp files of this library only.

#include "levelset/geometry/closest_on_triangle.h"
#include "levelset/geometry/search/overlap_tree.h"
#include "levelset/mesh.h"

namespace levelset {

/// Triangle with its number.
struct TriangleItem {
  using Number = double;
  static constexpr bool kHasExtent = true;
  std::array<Imath::V3d, 3> corners;
  std::uint32_t index;

  [[nodiscard]] ItemBox<double> box() const;
  [[nodiscard]] Imath::V3d closestPoint(const Imath::V3d& from) const;
  [[nodiscard]] double squaredDistance(const Imath::V3d& from) const;
  [[nodiscard]] bool isSameAs(const TriangleItem& other) const { return corners == other.corners; }
};

inline ItemBox<double> TriangleItem::box() const {
  ItemBox<double> box{corners[0], corners[0]};
  for (int axis = 0; axis < 3; ++axis)
    for (const Imath::V3d& p : corners) {
      box.low[axis] = std::min(box.low[axis], p[axis]);
      box.high[axis] = std::max(box.high[axis], p[axis]);
    }
  return box;
}

inline Imath::V3d TriangleItem::closestPoint(const Imath::V3d& from) const {
  return closestOnTriangle(from, corners[0], corners[1], corners[2]).point;
}

inline double TriangleItem::squaredDistance(const Imath::V3d& from) const {
  const Imath::V3d d = closestPoint(from) - from;
  return d.x * d.x + d.y * d.y + d.z * d.z;
}

/// Triangles in a tree, for searches of the closest ones.
using TriangleSearch = OverlapTree<TriangleItem>;
extern template class OverlapTree<TriangleItem>;

/// Makes the tree of a mesh. Copies the corners.
[[nodiscard]] TriangleSearch makeTriangleSearch(const TriMesh& mesh);

}  // namespace levelset
