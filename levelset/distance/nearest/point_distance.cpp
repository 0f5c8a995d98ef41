#include "levelset/distance/nearest/point_distance.h"

#include <cmath>

namespace levelset::eikonal {
namespace {

// A grid point keeps its old value if that equals the computed distance within the error of
// tricubic interpolation. kMostError is the upper limit of that error, voxels, reached at a radius
// of curvature of about 8 voxels.
constexpr double kMostError = 1e-3;

double unrefined(const NearestPoints::Block& block, openvdb::Index n, double shift) {
  const double distance = std::sqrt(static_cast<double>(block.squared[n]));
  return (block.inside.isOn(n) ? -distance : distance) - shift;
}

bool isNear(const NearestPoints::Block& block, openvdb::Index n, const DistanceRequest& request) {
  return block.nearest[n] != NearestPoints::kNone &&
         std::abs(unrefined(block, n, request.shift)) < request.halfWidth + kPolishGain;
}

}  // namespace

NearestPoints::Mask nearBand(const NearestPoints::Block& block, const DistanceRequest& request) {
  NearestPoints::Mask near;
  for (openvdb::Index word = 0; word < NearestPoints::Mask::WORD_COUNT; ++word) {
    std::uint64_t bits = 0;
    for (openvdb::Index i = 0; i < 64; ++i)
      bits |= static_cast<std::uint64_t>(isNear(block, 64 * word + i, request)) << i;
    near.getWord<std::uint64_t>(word) = bits;
  }
  return near;
}

PointDistance nearDistanceAt(const NearestPoints::Block& block, openvdb::Index n,
                             Polisher& polisher, const DistanceRequest& request) {
  const bool inside = block.inside.isOn(n);
  const Closest& closest = polisher.closest(block, n);
  PointDistance result{(inside ? -closest.distance : closest.distance) - request.shift, closest};
  // An inside grid point stays inside when its distance rounds to zero.
  if (inside && request.shift == 0) result.value = std::min(result.value, -1e-7);
  return result;
}

PointDistance distanceAt(const NearestPoints::Block& block, openvdb::Index n, Polisher& polisher,
                         const DistanceRequest& request) {
  if (isNear(block, n, request)) return nearDistanceAt(block, n, polisher, request);
  if (block.nearest[n] == NearestPoints::kNone) return {block.inside.isOn(n) ? -1e30 : 1e30};
  return {unrefined(block, n, request.shift)};
}

double keptOr(double value, double old, const Polisher& polisher, std::uint32_t surfacePoint) {
  const double change = std::abs(value - old);
  return change < kMostError && change < polisher.interpolationError(surfacePoint) ? old : value;
}

void setDistance(openvdb::FloatTree::LeafNodeType& leaf, openvdb::Index n, double value,
                 double halfWidth, double voxelSize, float background) {
  if (std::abs(value) < halfWidth)
    leaf.setValueOn(n, static_cast<float>(value * voxelSize));
  else
    leaf.setValueOff(n, value < 0 ? -background : background);
}

}  // namespace levelset::eikonal
