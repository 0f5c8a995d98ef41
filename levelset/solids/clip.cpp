#include "levelset/solids/clip.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"
#include "levelset/solids/csg_vdb.h"
#include "levelset/solids/fill_blocks_vdb.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using Imath::V3d;

InvalidInput nothingLeft() {
  return InvalidInput("clip: nothing is left, the solid lies outside; check the box or the plane");
}

Imath::Box3d worldBounds(const openvdb::FloatGrid& grid, const openvdb::CoordBBox& box) {
  const openvdb::BBoxd world = grid.transform().indexToWorld(box);
  return {toImath(world.min()), toImath(world.max())};
}

/// The solid's grid with the distance of a region of space, as far as the solid reaches.
template <typename Distance>
NarrowBand clipBy(const NarrowBand& solid, const Progress& progress, const Distance& distance) {
  report(progress, 0, "clip");
  const openvdb::FloatGrid& grid = vdb(solid);
  const auto region = emptyLevelSet(grid.transform().copy(), 1);
  region->tree().root().setBackground(grid.background(), /*updateChildNodes=*/false);
  const auto phi = [&](double i, double j, double k) {
    return distance(toImath(grid.indexToWorld(openvdb::Vec3d(i, j, k))));
  };
  if (!BlockFiller(*region, phi)
           .fill(grid.evalActiveVoxelBoundingBox(), subProgress(progress, 0, 0.5), "clip"))
    throw nothingLeft();
  openvdb::FloatGrid::Ptr merged = mergePair(CsgOperation::Intersection, grid, *region);
  if (!hasInside(*merged)) throw nothingLeft();
  report(progress, 1, "clip");
  return makeBand(std::move(merged));
}

void requireSurface(const NarrowBand& solid) {
  requireSolid(solid, "clip");
  if (solid.isEmpty()) throw InvalidInput("clip: the solid has no surface");
}

}  // namespace

NarrowBand clip(const NarrowBand& solid, const Imath::Box3d& box, const Progress& progress) {
  requireSurface(solid);
  for (int axis = 0; axis < 3; ++axis) {
    if (box.min[axis] < box.max[axis]) continue;  // false for NaN
    throw UsageError(
        fmt::format("clip: the box reaches from {} to {} along axis {}; its lower corner "
                    "must be below its upper one",
                    box.min[axis], box.max[axis], "xyz"[axis]));
  }
  // Faces far beyond the band change nothing there; cut back, an infinite box is a finite one.
  const openvdb::FloatGrid& grid = vdb(solid);
  Imath::Box3d reach = worldBounds(grid, grid.evalActiveVoxelBoundingBox());
  const double margin = 4 * static_cast<double>(grid.background());
  V3d center, half;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = std::max(box.min[axis], reach.min[axis] - margin);
    const double high = std::min(box.max[axis], reach.max[axis] + margin);
    if (!(low < high)) throw nothingLeft();
    center[axis] = (low + high) / 2;
    half[axis] = (high - low) / 2;
  }
  return clipBy(solid, progress, [=](const V3d& p) {
    const V3d q(std::abs(p.x - center.x) - half.x, std::abs(p.y - center.y) - half.y,
                std::abs(p.z - center.z) - half.z);
    const V3d outside(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
    return outside.length() + std::min(std::max({q.x, q.y, q.z}), 0.0);
  });
}

NarrowBand clip(const NarrowBand& solid, const Imath::Plane3d& plane, const Progress& progress) {
  requireSurface(solid);
  const double length = plane.normal.length();
  if (!(length > 0) || !std::isfinite(length) || !std::isfinite(plane.distance)) {
    throw UsageError(
        fmt::format("clip: the plane has normal {},{},{} and distance {}; it needs a "
                    "finite direction and distance",
                    plane.normal.x, plane.normal.y, plane.normal.z, plane.distance));
  }
  const V3d normal = plane.normal / length;
  const double distance = plane.distance / length;
  return clipBy(solid, progress, [=](const V3d& p) { return (normal ^ p) - distance; });
}

}  // namespace levelset
