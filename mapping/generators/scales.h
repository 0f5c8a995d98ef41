#pragma once

#include "levelset/narrow_band.h"
#include "levelset/shapes/shapes.h"
#include "mapping/generators/tiling.h"

namespace mapping {

/// Scales of fish or reptiles on a plate: flat tongues in rows along x, with tips towards +y. Each
/// row is shifted along x by half a width and lies under the tips of the previous row. With an even
/// number of rows the pattern continues across the sides of its tile.
struct Scales {
  /// Length of a scale along its slope, from the plate to its tip, world units.
  double length = 1.4;
  double width = 1;           ///< width of a scale and distance of scales in a row, world units
  double thickness = 0;       ///< thickness of a scale, world units; 0: solid down to the plate
  double tilt = 0.349065850;  ///< angle of a scale to the plate, radians
  double step = 0;            ///< distance between rows, world units; 0: half a length
  /// Length of the pointed part of a scale, world units; 0: half a width, which makes a half
  /// circle.
  double tip = 0;
  double rounding = 0;  ///< rounding radius of the scales' edges, world units
  double base = 0.3;    ///< thickness of the plate, world units
  Tiling tiling = {};
};

[[nodiscard]] TileBox scalesBox(const Scales& scales, const Imath::V3d& center);
[[nodiscard]] levelset::ShapeExtent scalesExtent(const Scales& scales, const Imath::V3d& center);
void checkScales(const Scales& scales, const Imath::V3d& center, double voxelSize,
                 const levelset::ShapeOptions& options = {});

/// Builds scales.
/// @throws UsageError for lengths and angles out of range, tips longer than their scales, and rows
///         that do not overlap
/// @throws InvalidInput for a width, a thickness, or a gap under the tips, of less than two voxels
/// @throws ResourceLimit if the memory estimate exceeds the limit
/// @throws Cancelled if the progress callback cancels
[[nodiscard]] levelset::NarrowBand makeScales(const Scales& scales, const Imath::V3d& center,
                                              double voxelSize,
                                              const levelset::ShapeOptions& options = {});

}  // namespace mapping
