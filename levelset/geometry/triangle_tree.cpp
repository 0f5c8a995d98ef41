#include "levelset/geometry/triangle_tree.h"

#include <cmath>

#include "levelset/geometry/closest_on_triangle.h"

namespace levelset {

using openvdb::Vec3d;

TriangleTree::TriangleTree(std::vector<Triangle> triangles)
    : tree_(
          triangles.size(),
          [&](std::uint32_t i, Vec3d& low, Vec3d& high) {
            for (const Vec3d& p : triangles[i]) {
              low = openvdb::math::minComponent(low, p);
              high = openvdb::math::maxComponent(high, p);
            }
          },
          [&](std::uint32_t i, int axis) {
            const Triangle& t = triangles[i];
            return t[0][axis] + t[1][axis] + t[2][axis];
          }) {
  triangles_.reserve(triangles.size());
  for (const std::uint32_t i : tree_.order()) triangles_.push_back(triangles[i]);
}

TriangleTree::Hit TriangleTree::nearest(const Vec3d& from, double limit) const {
  double squared = limit * limit;
  Hit hit;
  tree_.search(from, squared, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t i = begin; i < end; ++i) {
      const auto& [a, b, c] = triangles_[i];
      const Vec3d point = closestOnTriangle(from, a, b, c).point;
      const double d = (point - from).lengthSqr();
      if (!(d < squared)) continue;
      squared = d;
      hit.point = point;
      hit.found = true;
    }
  });
  hit.distance = std::sqrt(squared);
  return hit;
}

}  // namespace levelset
