#include "levelset/solids/offset.h"

#include <fmt/core.h>

#include <cmath>

#include "levelset/eikonal/distance_transform.h"
#include "levelset/error.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

// What the interpolant reads beside the moved surface before distances are made again.
constexpr double kShell = 3;

double checkedHalfWidth(const NarrowBand& solid, const OffsetOptions& options) {
  const double halfWidth = options.halfWidth.value_or(solid.halfWidth());
  if (!std::isfinite(halfWidth) || halfWidth < 1)
    throw UsageError(
        fmt::format("{}: the half width is {} voxels; give at least 1", options.action, halfWidth));
  return halfWidth;
}

}  // namespace

NarrowBand offset(NarrowBand solid, double distance, const OffsetOptions& options) {
  if (!std::isfinite(distance))
    throw UsageError(
        fmt::format("{}: the distance is {}; give a finite length", options.action, distance));
  if (solid.isEmpty())
    throw InvalidInput(fmt::format(
        "{}: the solid is empty, so there is no surface to move; give a solid", options.action));
  const double halfWidth = checkedHalfWidth(solid, options);
  if (distance == 0 && halfWidth == solid.halfWidth()) return solid;

  eikonal::DistanceRequest request;
  request.action = options.action;
  request.maxMemory = options.maxMemory;

  // === Distances out to the new surface, kept beside it only
  openvdb::FloatGrid::Ptr moved;
  if (distance != 0) {
    request.halfWidth = kShell;
    request.shift = distance / solid.voxelSize();
    request.progress = subProgress(options.progress, 0, 0.6);
    moved = eikonal::distanceTransform(vdb(solid), request);
    if (moved->activeVoxelCount() == 0 || !eikonal::hasZeroCrossing(moved->tree()))
      throw InvalidInput(
          fmt::format("{}: nothing is left of the solid after {} world units; no part of it is "
                      "thicker than twice that, use a smaller length",
                      options.action, distance));
  }

  // === A distance again: where fronts met, the shifted one is only a bound
  request.halfWidth = halfWidth;
  request.shift = 0;
  request.progress = subProgress(options.progress, distance != 0 ? 0.6 : 0, 1);
  return makeBand(eikonal::distanceTransform(moved ? *moved : vdb(solid), request));
}

}  // namespace levelset
