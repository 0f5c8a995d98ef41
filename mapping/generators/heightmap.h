#pragma once

#include <vector>

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/shapes/shapes.h"
#include "mapping/generators/tiling.h"

namespace mapping {

/// Heights at the nodes of a rectangular grid, like the pixels of a picture.
struct HeightGrid {
  int columns = 0, rows = 0;    ///< numbers of nodes along x and y, each at least 2
  std::vector<double> heights;  ///< rows × columns, values 0 … 1; the first row has the largest y
};

enum class HeightInterpolation {
  Linear,  ///< linear along each axis, with creases along the grid lines
  Cubic    ///< cubic convolution [Keys81]: smooth; may exceed the range of values by up to 29 %
};

struct Heightmap {
  HeightGrid grid = {};
  Imath::V2d size{1, 1};  ///< extents along x and y between the outermost nodes, world units
  double height = 1;      ///< height of the grid value 1 above the value 0, world units
  double base = 0;        ///< thickness of the solid below the grid value 0, world units
  HeightInterpolation interpolation = HeightInterpolation::Cubic;
};

/// Interpolated grid value at u and v, which run from 0 to 1 along x and y.
[[nodiscard]] double heightAt(const Heightmap& heightmap, double u, double v);

/// Boxes `tile` and `whole` of the solid. Along z, both contain the base and grid values from 0 to
/// 1.
[[nodiscard]] TileBox heightmapBox(const Heightmap& heightmap, const Imath::V3d& center);
[[nodiscard]] levelset::ShapeExtent heightmapExtent(const Heightmap& heightmap,
                                                    const Imath::V3d& center);
void checkHeightmap(const Heightmap& heightmap, const Imath::V3d& center, double voxelSize,
                    const levelset::ShapeOptions& options = {});

/// Builds the solid between the interpolated heights and the bottom of the base.
/// @throws UsageError for lengths out of range, a grid of fewer than two columns or rows, and
///         heights that are not finite
/// @throws InvalidInput if no grid point lies inside
/// @throws ResourceLimit if the memory estimate exceeds the limit
/// @throws Cancelled if the progress callback cancels
[[nodiscard]] levelset::NarrowBand makeHeightmap(const Heightmap& heightmap,
                                                 const Imath::V3d& center, double voxelSize,
                                                 const levelset::ShapeOptions& options = {});

/// Builds only the interpolated heights, as an open mesh that faces up: a terrain that
/// surfaceBand() can turn into the base of a texture. Vertices are at most `spacing` apart, evenly
/// along x and along y, with u and v as texture coordinates. Parts that lie below the bottom of the
/// base, where makeHeightmap clips the solid, are kept.
/// @throws UsageError for the errors of makeHeightmap, and for a spacing that is not positive
/// @throws ResourceLimit if the memory estimate exceeds the limit
/// @throws Cancelled if the progress callback cancels
[[nodiscard]] levelset::TriMesh heightmapSheet(const Heightmap& heightmap, const Imath::V3d& center,
                                               double spacing,
                                               const levelset::ShapeOptions& options = {});

}  // namespace mapping
