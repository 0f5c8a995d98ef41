#include "levelset/distance/closest_points.h"

#include <fmt/core.h>

#include <cmath>
#include <mutex>

#include "levelset/distance/distance_transform.h"
#include "levelset/error.h"
#include "levelset/fields/grid_vdb.h"

namespace levelset {
namespace {

/// Builds a grid with the value make(p) at each grid point within the half width, where p is the
/// closest point of the surface in world units.
template <typename Grid, typename Make>
typename Grid::Ptr gridOfClosestPoints(const NarrowBand& solid, const ClosestPointOptions& options,
                                       const Make& make) {
  using GridLeaf = typename Grid::TreeType::LeafNodeType;
  requireSolid(solid);
  if (solid.isEmpty())
    throw InvalidInput("the solid is empty, so it has no surface; give a solid with a surface");
  eikonal::DistanceRequest request;
  request.halfWidth = options.halfWidth.value_or(solid.halfWidth());
  if (!std::isfinite(request.halfWidth) || request.halfWidth < 1)
    throw UsageError(
        fmt::format("the half width is {} voxels; give at least 1", request.halfWidth));
  request.maxMemory = options.maxMemory;
  request.progress = options.progress;

  const openvdb::FloatGrid& field = vdb(solid);
  typename Grid::Ptr grid = Grid::create();
  grid->setTransform(field.transform().copy());
  std::mutex mutex;
  request.visitPoints = [&](const openvdb::FloatTree::LeafNodeType& leaf,
                            const eikonal::ClosestPointLeaf& points) {
    auto part = std::make_unique<GridLeaf>(leaf.origin());
    for (auto it = leaf.cbeginValueOn(); it; ++it)
      part->setValueOn(it.pos(), make(field.indexToWorld(points[it.pos()])));
    const std::lock_guard lock(mutex);
    grid->tree().addLeaf(part.release());
  };
  (void)eikonal::distanceTransform(field, request);
  return grid;
}

}  // namespace

FieldGrid closestPoints(const NarrowBand& solid, const ClosestPointOptions& options) {
  const auto grid = gridOfClosestPoints<openvdb::Vec3SGrid>(
      solid, options, [](const openvdb::Vec3d& p) { return openvdb::Vec3s(p); });
  grid->setName("closest_point");
  grid->setVectorType(openvdb::VEC_CONTRAVARIANT_ABSOLUTE);
  return importField(grid);
}

FieldGrid extendOffSurface(const NarrowBand& solid, const ScalarField& attribute,
                           const ClosestPointOptions& options) {
  if (!attribute)
    throw UsageError("there is no attribute to extend; give a formula or a grid of numbers");
  const auto grid = gridOfClosestPoints<openvdb::FloatGrid>(
      solid, options,
      [&](const openvdb::Vec3d& p) { return static_cast<float>(attribute(toImath(p))); });
  grid->setName("attribute");
  return importField(grid);
}

FieldGrid extendOffSurface(const NarrowBand& solid, const VectorField& attribute,
                           const ClosestPointOptions& options) {
  if (!attribute) throw UsageError("there is no attribute to extend; give a grid of vectors");
  const auto grid = gridOfClosestPoints<openvdb::Vec3SGrid>(
      solid, options,
      [&](const openvdb::Vec3d& p) { return openvdb::Vec3s(toVdb(attribute(toImath(p), 0))); });
  grid->setName("attribute");
  return importField(grid);
}

}  // namespace levelset
