#pragma once

// Builds bands of solids whose distance is given by a formula. Includes OpenVDB: for .cpp files
// only.

#include <fmt/core.h>

#include <cmath>

#include "levelset/error.h"
#include "levelset/grids/fill_blocks_vdb.h"
#include "levelset/shapes/shapes.h"
#include "levelset/vdb.h"

namespace levelset {

/// Builds the band of a solid from a distance function.
/// @param distance  double(const V3d&): signed distance at a world position, negative inside.
///         Outside the band, any lower bound of its magnitude with the correct sign suffices.
/// @throws as checkShape()
/// @throws InvalidInput if no grid point lies inside
template <typename Distance>
NarrowBand makeShape(const ShapeExtent& extent, double voxelSize, const ShapeOptions& options,
                     const Distance& distance) {
  checkShape(extent, voxelSize, options);
  report(options.progress, 0);

  const auto grid = emptyLevelSet(uniformTransform(voxelSize), options.halfWidth);
  openvdb::CoordBBox domain;
  for (int axis = 0; axis < 3; ++axis) {
    domain.min()[axis] =
        static_cast<int>(std::floor(extent.bounds.min[axis] / voxelSize - options.halfWidth)) - 1;
    domain.max()[axis] =
        static_cast<int>(std::ceil(extent.bounds.max[axis] / voxelSize + options.halfWidth)) + 1;
  }
  const auto phi = [&](double i, double j, double k) {
    return distance(Imath::V3d(i * voxelSize, j * voxelSize, k * voxelSize));
  };
  BlockFiller filler(*grid, phi);
  if (!isEverywhere(options.region)) {
    const openvdb::CoordBBox blocks = blocksOf(options.region, grid->transform());
    filler.limitTo(blocks);
    domain.intersect(blocks);
  }
  if (!filler.fill(domain, options.progress)) {
    throw InvalidInput(
        fmt::format("no grid point lies inside the shape, because it is too thin for voxels "
                    "of {}; use smaller voxels",
                    voxelSize));
  }
  return makeBand(grid);
}

}  // namespace levelset
