#include "mapping/surface/surface_projection.h"

#include <fmt/core.h>

#include <cmath>
#include <limits>

#include "levelset/error.h"
#include "levelset/vdb.h"
#include "mapping/surface/surface_field.h"

namespace mapping {
namespace {

using Imath::V3d;

/// Finds the grid point nearest to `point` among those within a voxel of the surface. All positions
/// are in world coordinates.
V3d nearestFoot(const levelset::NarrowBand& base, const V3d& point) {
  const openvdb::FloatGrid& grid = levelset::vdb(base);
  const double voxel = base.voxelSize();
  const openvdb::Vec3d goal = grid.worldToIndex(levelset::toVdb(point));
  double best = std::numeric_limits<double>::max();
  openvdb::Coord nearest;
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
    const openvdb::Vec3d middle = leaf->origin().asVec3d() + openvdb::Vec3d(3.5);
    if ((middle - goal).length() - 6.1 > best) continue;  // half a leaf's diagonal is 6.06
    for (auto it = leaf->cbeginValueOn(); it; ++it) {
      const double value = std::abs(static_cast<double>(*it)) / voxel;
      if (value > 1) continue;
      const double distance = (it.getCoord().asVec3d() - goal).length();
      if (distance >= best) continue;
      best = distance;
      nearest = it.getCoord();
    }
  }
  return levelset::toImath(grid.indexToWorld(nearest));
}

[[noreturn]] void failBrokenOff(const V3d& foot, const V3d& point) {
  throw levelset::InvalidInput(fmt::format(
      "the surface breaks off at about ({:.6g}, {:.6g}, {:.6g}), before the point ({:.6g}, "
      "{:.6g}, {:.6g}); choose a point further inside its border",
      foot.x, foot.y, foot.z, point.x, point.y, point.z));
}

}  // namespace

V3d closestSurfacePoint(const levelset::NarrowBand& base, const V3d& point) {
  const auto at = [&] {
    return fmt::format("({:.6g}, {:.6g}, {:.6g})", point.x, point.y, point.z);
  };
  if (!std::isfinite(point.x) || !std::isfinite(point.y) || !std::isfinite(point.z)) {
    throw levelset::UsageError(
        fmt::format("the point {} is not finite; give finite coordinates", at()));
  }
  if (base.isEmpty()) {
    throw levelset::InvalidInput("the base has no surface; give a solid with at least one voxel");
  }
  const SurfaceField field(base);
  V3d foot = point;
  if (!field.project(foot, 0)) {
    if (base.zeroSetBounds().isEmpty()) {
      throw levelset::InvalidInput("the base has no surface; give a solid with at least one voxel");
    }
    foot = nearestFoot(base, point);
    if (!field.project(foot, 0)) {
      if (base.isOpenSurface()) failBrokenOff(foot, point);
      throw levelset::InvalidInput(
          fmt::format("the field near ({:.6g}, {:.6g}, {:.6g}), nearest to the point {}, is not a "
                      "distance field; re-distance the base first",
                      foot.x, foot.y, foot.z, at()));
    }
  }
  // Gradient descent of the distance to `point` along the surface; the step length is halved when a
  // step comes no nearer.
  double step = 1;
  for (int i = 0; i < 60 && step > 1e-3; ++i) {
    const V3d normal = field.normal(foot), offset = point - foot;
    const V3d along = offset - normal * offset.dot(normal);
    if (along.length() < 1e-6 * base.voxelSize()) break;
    V3d next = foot + along * std::min(step, base.voxelSize() / along.length());
    if (field.project(next, 0) && (point - next).length() < offset.length()) {
      foot = next;
    } else {
      step *= 0.5;
    }
  }
  // On an open surface the line to the closest point is normal to the surface, unless the closest
  // point is on the border.
  if (base.isOpenSurface()) {
    const V3d normal = field.normal(foot), offset = point - foot;
    constexpr double kBeyondVoxels = 1, kSlant = 0.02;
    const double along = (offset - normal * offset.dot(normal)).length();
    if (along > kBeyondVoxels * base.voxelSize() && along > kSlant * offset.length())
      failBrokenOff(foot, point);
  }
  const double distance = (point - foot).length();
  // A point within the band is never too far from the surface, and computing the bounding box would
  // visit every voxel.
  if (distance <= base.halfWidth() * base.voxelSize()) return foot;
  const double diagonal = base.zeroSetBounds().size().length();
  if (distance > diagonal) {
    throw levelset::InvalidInput(
        fmt::format("the point {} is {:.6g} away from the surface, more than the diagonal {:.6g} "
                    "of its bounding box; give a point near the base",
                    at(), distance, diagonal));
  }
  return foot;
}

}  // namespace mapping
