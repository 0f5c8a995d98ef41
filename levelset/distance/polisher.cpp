#include "levelset/distance/polisher.h"

#include <algorithm>

#include "levelset/distance/surface/closest_point.h"

namespace levelset::eikonal {
namespace {

using openvdb::Coord;
using openvdb::Vec3d;
using LeafNode = openvdb::FloatTree::LeafNodeType;

// If the nearest surface points of two neighbouring grid points are farther apart than this, in
// voxels, these points belong to different parts of the surface.
constexpr double kOtherPart = 2;
// The error of distances by tricubic interpolation, voxels, is about kTricubicError times the
// square of the curvature. Its lower limit is kRounding.
constexpr double kTricubicError = 0.03, kRounding = 1e-6;
// Number of searches for a foot point. Each starts where the search before it left its dense block,
// the stored values around a leaf.
constexpr int kAttempts = 4;

}  // namespace

double Polisher::interpolationError(std::uint32_t point) const {
  const Jet jet = points_.jets[point].jet();
  const double bend = jet.xx * jet.xx + jet.yy * jet.yy + jet.zz * jet.zz +
                      2 * (jet.xy * jet.xy + jet.xz * jet.xz + jet.yz * jet.yz);
  const double slope = jet.gradient.lengthSqr();
  return std::max(kRounding, slope > 0 ? kTricubicError * bend / slope : 0);
}

Closest Polisher::closest(const NearestPoints::Block& block, openvdb::Index n) {
  const Coord c = block.origin + LeafNode::offsetToLocalCoord(n);
  const Vec3d x = c.asVec3d();
  const std::uint32_t first = block.nearest[n];
  const Vec3d nearest = points_.positions[first];
  Closest best{nearest, (x - nearest).length()};
  const double start = best.distance;
  if (!block.own.isOn(n)) best.takeIfNearer(polish(x, first));
  for (int axis = 0; axis < 3; ++axis)
    for (int side = -1; side <= 1; side += 2) {
      Coord beside = c;
      beside[axis] += side;
      const std::uint32_t other = NearestPoints::nearestAt(block, beside);
      if (other == NearestPoints::kNone || other == first) continue;
      const Vec3d point = points_.positions[other];
      if ((point - nearest).lengthSqr() < kOtherPart * kOtherPart) continue;
      if ((x - point).length() < start + kPolishGain) best.takeIfNearer(polish(x, other));
    }
  return best;
}

Closest Polisher::polish(const Vec3d& x, std::uint32_t point) {
  const Vec3d start = points_.positions[point];
  if (!points_.sharp[point]) {
    const Foot foot = closestPointByTwoSteps(cache_, points_.jets[point].jet(), x, start);
    if (foot.converged && !patches_.covers(Coord::floor(foot.point)) && isOnSurface(foot.point))
      return {foot.point, foot.distance};
    return polishOnInterpolant(x, start);
  }
  const TriangleTree::Hit hit = patches_.nearest(x, (x - start).length());
  if (!hit.found) return {start, (x - start).length()};
  if (patches_.covers(Coord::floor(hit.point))) return {hit.point, hit.distance};
  return polishOnInterpolant(x, hit.point);
}

Closest Polisher::polishOnInterpolant(const Vec3d& x, Vec3d start) {
  const Closest first{start, (x - start).length()};
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const DenseBlock& block = cache_.around(start);
    const Vec3d origin = block.origin().asVec3d();
    const Foot foot = closestPoint(block, x - origin, start - origin);
    if (foot.converged) {
      if (!changesSignAround(block, foot.point)) break;
      const Closest smooth{foot.point + origin, foot.distance};
      if (!patches_.covers(Coord::floor(smooth.point))) return smooth;
      const TriangleTree::Hit hit = patches_.nearest(x, foot.distance + kPolishGain);
      return hit.found ? Closest{hit.point, hit.distance} : smooth;
    }
    if (!foot.left) break;
    start = foot.point + origin;
  }
  return first;
}

bool Polisher::isOnSurface(const Vec3d& point) {
  const DenseBlock& block = cache_.around(point);
  return changesSignAround(block, point - block.origin().asVec3d());
}

}  // namespace levelset::eikonal
