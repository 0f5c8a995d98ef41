#include "levelset/distance/point_distance.h"

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

}  // namespace

NearestPoints::Mask nearBand(const NearestPoints::Block& block, const DistanceRequest& request) {
  NearestPoints::Mask near;
  for (openvdb::Index n = 0; n < 512; ++n)
    if (block.nearest[n] != NearestPoints::kNone &&
        std::abs(unrefined(block, n, request.shift)) < request.halfWidth + kPolishGain)
      near.setOn(n);
  return near;
}

PointDistance distanceAt(const NearestPoints::Block& block, openvdb::Index n, Polisher& polisher,
                         const DistanceRequest& request) {
  const bool inside = block.inside.isOn(n);
  const double sign = inside ? -1 : 1;
  PointDistance result{sign * 1e30};
  if (block.nearest[n] != NearestPoints::kNone) {
    result.value = unrefined(block, n, request.shift);
    if (std::abs(result.value) < request.halfWidth + kPolishGain) {
      result.closest = polisher.closest(block, n);
      result.value = sign * result.closest->distance - request.shift;
    }
  }
  // An inside grid point stays inside when its distance rounds to zero.
  if (inside && request.shift == 0) result.value = std::min(result.value, -1e-7);
  return result;
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
