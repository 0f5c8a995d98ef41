#include "levelset/distance/redistance.h"

#include <fmt/core.h>

#include <cmath>

#include "levelset/distance/distance_transform.h"
#include "levelset/error.h"

namespace levelset {
namespace {

/// Returns the smallest index box of grid points that contains a world box.
openvdb::CoordBBox gridBox(const openvdb::math::Transform& transform, const Imath::Box3d& box) {
  openvdb::BBoxd index;
  for (int corner = 0; corner < 8; ++corner) {
    const Imath::V3d p(corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                       corner & 4 ? box.max.z : box.min.z);
    index.expand(transform.worldToIndex(toVdb(p)));
  }
  // Rounding must not add a layer of grid points.
  const openvdb::Vec3d slack(1e-6);
  return {openvdb::Coord::floor(index.min() + slack), openvdb::Coord::ceil(index.max() - slack)};
}

bool isFinite(const Imath::Box3d& box) {
  for (int i = 0; i < 3; ++i)
    if (!std::isfinite(box.min[i]) || !std::isfinite(box.max[i])) return false;
  return true;
}

}  // namespace

NarrowBand redistance(NarrowBand field, const RedistanceOptions& options) {
  requireSolid(field);
  if (field.isEmpty())
    throw NoSurface("the field is empty and has no zero crossing; give a solid with a surface");
  eikonal::DistanceRequest request;
  request.halfWidth = options.halfWidth.value_or(field.halfWidth());
  if (!std::isfinite(request.halfWidth) || request.halfWidth < 1)
    throw UsageError(
        fmt::format("the half width is {} voxels; give at least 1", request.halfWidth));
  if (options.region) {
    if (options.region->isEmpty() || !isFinite(*options.region))
      throw UsageError(
          "the region is empty or has a coordinate that is not finite; give a finite box");
    request.region = gridBox(vdb(field).transform(), *options.region);
  }
  request.maxMemory = options.maxMemory;
  request.progress = options.progress;
  return makeBand(eikonal::distanceTransform(vdb(field), request));
}

Cost costOfDistances(double layer, double halfWidth) {
  // The first term in each sum is for the points on the surface, the second for the closest point
  // of each grid point. Smooth surfaces take less time, faceted surfaces with edges everywhere take
  // more.
  return {1e-9 * layer * (1250 + 1060 * 2 * halfWidth), layer * (540 + 6 * 2 * halfWidth)};
}

}  // namespace levelset
