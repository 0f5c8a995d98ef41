#include "levelset/csg/clip.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/csg/csg_vdb.h"
#include "levelset/error.h"
#include "levelset/grids/fill_blocks_vdb.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using Imath::V3d;

NoSurface nothingLeft() {
  return NoSurface(
      "the result is empty, because the solid lies outside the box or in front of the plane; check "
      "the position of the box or plane");
}

Imath::Box3d worldBounds(const openvdb::FloatGrid& grid, const openvdb::CoordBBox& box) {
  const openvdb::BBoxd world = grid.transform().indexToWorld(box);
  return {toImath(world.min()), toImath(world.max())};
}

/// Returns the index bounds of all grid points in the band or inside the solid. The bounds of the
/// band do not suffice, since a cropped solid has no band where it was cropped.
openvdb::CoordBBox solidBounds(const openvdb::FloatGrid& grid) {
  openvdb::CoordBBox bounds = grid.evalActiveVoxelBoundingBox();
  openvdb::CoordBBox tile;
  auto it = grid.tree().cbeginValueAll();
  it.setMaxDepth(openvdb::FloatTree::DEPTH - 2);
  for (; it; ++it)
    if (*it < 0 && it.getBoundingBox(tile)) bounds.expand(tile);
  return bounds;
}

/// Intersects a solid with a region of space, given as a signed distance function. Samples the
/// function only within the bounds of the solid.
template <typename Distance>
NarrowBand clipBy(const NarrowBand& solid, const Progress& progress, const Distance& distance) {
  report(progress, 0);
  const openvdb::FloatGrid& grid = vdb(solid);
  const auto region = emptyLevelSet(grid.transform().copy(), 1);
  region->tree().root().setBackground(grid.background(), /*updateChildNodes=*/false);
  const auto phi = [&](double i, double j, double k) {
    return distance(toImath(grid.indexToWorld(openvdb::Vec3d(i, j, k))));
  };
  if (!BlockFiller(*region, phi).fill(solidBounds(grid), subProgress(progress, 0, 0.5)))
    throw nothingLeft();
  NarrowBand merged = mergePair(CsgOperation::Intersection, solid, makeBand(region));
  if (!hasInside(vdb(merged))) throw nothingLeft();
  report(progress, 1);
  return merged;
}

void requireSurface(const NarrowBand& solid) {
  requireSolid(solid);
  if (solid.isEmpty()) throw NoSurface("the solid is empty; give a solid with a surface");
}

}  // namespace

NarrowBand clip(const NarrowBand& solid, const Imath::Box3d& box, const Progress& progress) {
  requireSurface(solid);
  for (int axis = 0; axis < 3; ++axis) {
    if (box.min[axis] < box.max[axis]) continue;  // false for NaN
    throw UsageError(
        fmt::format("the box extends from {} to {} along axis {}; its lower corner "
                    "must be below its upper one",
                    box.min[axis], box.max[axis], "xyz"[axis]));
  }
  // Refuse a box outside the solid before any work.
  const openvdb::FloatGrid& grid = vdb(solid);
  const Imath::Box3d reach = worldBounds(grid, solidBounds(grid));
  for (int axis = 0; axis < 3; ++axis)
    if (box.min[axis] > reach.max[axis] || box.max[axis] < reach.min[axis]) throw nothingLeft();
  // Compute the distance to each face separately, so that the bits of a value do not depend on the
  // positions of other faces.
  return clipBy(solid, progress, [=](const V3d& p) {
    const V3d q(std::max(box.min.x - p.x, p.x - box.max.x),
                std::max(box.min.y - p.y, p.y - box.max.y),
                std::max(box.min.z - p.z, p.z - box.max.z));
    const V3d outside(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
    return outside.length() + std::min(std::max({q.x, q.y, q.z}), 0.0);
  });
}

NarrowBand clip(const NarrowBand& solid, const Imath::Plane3d& plane, const Progress& progress) {
  requireSurface(solid);
  const double length = plane.normal.length();
  if (!(length > 0) || !std::isfinite(length) || !std::isfinite(plane.distance)) {
    throw UsageError(
        fmt::format("the plane has normal {},{},{} and distance {}; give a finite normal other "
                    "than zero and a finite distance",
                    plane.normal.x, plane.normal.y, plane.normal.z, plane.distance));
  }
  const V3d normal = plane.normal / length;
  const double distance = plane.distance / length;
  return clipBy(solid, progress, [=](const V3d& p) { return (normal ^ p) - distance; });
}

}  // namespace levelset
