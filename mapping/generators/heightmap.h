#pragma once

#include <vector>

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/solids/shapes.h"
#include "mapping/generators/tiling.h"

namespace mapping {

/// Heights at the nodes of a rectangular grid, as a picture has its pixels.
struct HeightGrid {
  int columns = 0, rows = 0;    ///< at least 2 of each
  std::vector<double> heights;  ///< rows × columns, 0 … 1; the first row has the largest y
};

enum class HeightInterpolation {
  Linear,  ///< along each axis, creases along the grid's lines
  Cubic    ///< cubic convolution [Keys81]: smooth, may pass the heights beside steps by a quarter
};

struct Heightmap {
  HeightGrid grid = {};
  Imath::V2d size{1, 1};  ///< from the first column and row to the last, world units
  double height = 1;      ///< of what is 1, above what is 0
  double base = 0;        ///< of solid below what is 0
  HeightInterpolation interpolation = HeightInterpolation::Cubic;
};

/// Of the grid alone: the height at u, v in 0 … 1 along x and y.
[[nodiscard]] double heightAt(const Heightmap& heightmap, double u, double v);

/// The box of base and height.
[[nodiscard]] TileBox heightmapBox(const Heightmap& heightmap, const Imath::V3d& center);
[[nodiscard]] levelset::ShapeExtent heightmapExtent(const Heightmap& heightmap,
                                                    const Imath::V3d& center);
void checkHeightmap(const Heightmap& heightmap, const Imath::V3d& center, double voxelSize,
                    const levelset::ShapeOptions& options = {});

/// @throws UsageError for lengths out of range, a grid of fewer than two columns or rows, heights
///         that are not finite; InvalidInput when no grid point lies inside; ResourceLimit;
///         Cancelled
[[nodiscard]] levelset::NarrowBand makeHeightmap(const Heightmap& heightmap,
                                                 const Imath::V3d& center, double voxelSize,
                                                 const levelset::ShapeOptions& options = {});

/// Its top alone, as an open mesh that faces up: a terrain, to be a base by surfaceBand.
/// Vertices lie `spacing` apart or closer, evenly along x and along y, with u and v as texture
/// coordinates. Heights are those of the picture, also where a solid would be cut off below.
/// @throws UsageError as makeHeightmap does, and for a spacing that is not positive; ResourceLimit;
///         Cancelled
[[nodiscard]] levelset::TriMesh heightmapSheet(const Heightmap& heightmap, const Imath::V3d& center,
                                               double spacing,
                                               const levelset::ShapeOptions& options = {});

}  // namespace mapping
