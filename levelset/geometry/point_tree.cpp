#include "levelset/geometry/point_tree.h"

namespace levelset::eikonal {

using openvdb::Vec3d;

PointTree::PointTree(std::span<const Vec3d> points)
    : points_(points),
      tree_(
          points.size(),
          [points](std::uint32_t i, Vec3d& low, Vec3d& high) {
            low = openvdb::math::minComponent(low, points[i]);
            high = openvdb::math::maxComponent(high, points[i]);
          },
          [points](std::uint32_t i, int axis) { return points[i][axis]; }) {}

std::uint32_t PointTree::nearest(const Vec3d& query, double limit) const {
  double squared = limit * limit;
  std::uint32_t best = kNone;
  tree_.search(query, squared, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t i = begin; i < end; ++i) {
      const std::uint32_t point = tree_.order()[i];
      const double distance = (query - points_[point]).lengthSqr();
      if (distance > squared || (distance == squared && point > best)) continue;
      // A point exactly at the limit does not count.
      if (distance == squared && best == kNone) continue;
      squared = distance;
      best = point;
    }
  });
  return best;
}

}  // namespace levelset::eikonal
