#pragma once

#include "levelset/narrow_band.h"
#include "levelset/solids/shapes.h"
#include "mapping/generators/tiling.h"

namespace mapping {

/// Scales of fish or reptiles on a plate: flat tongues in rows along x, tips towards +y, each row
/// half a width aside of the one before and under its tips. An even number of rows goes on across
/// its tile's sides.
struct Scales {
  double length = 1.4;        ///< of a scale, from the plate to its tip, world units
  double width = 1;           ///< of a scale, and from one to the next of a row
  double thickness = 0;       ///< of a scale; 0: solid down to the plate
  double tilt = 0.349065850;  ///< radians from the plate
  double step = 0;            ///< from row to row; 0: half a length
  double tip = 0;             ///< length of the pointed part; 0: half a width, which is round
  double rounding = 0;        ///< radius of the edges
  double base = 0.3;          ///< thickness of the plate
  Tiling tiling = {};
};

[[nodiscard]] TileBox scalesBox(const Scales& scales, const Imath::V3d& center);
[[nodiscard]] levelset::ShapeExtent scalesExtent(const Scales& scales, const Imath::V3d& center);
void checkScales(const Scales& scales, const Imath::V3d& center, double voxelSize,
                 const levelset::ShapeOptions& options = {});

/// @throws UsageError for lengths and angles out of range, tips longer than their scales and rows
///         that do not overlap; InvalidInput for a width or thickness under two voxels;
///         ResourceLimit; Cancelled
[[nodiscard]] levelset::NarrowBand makeScales(const Scales& scales, const Imath::V3d& center,
                                              double voxelSize,
                                              const levelset::ShapeOptions& options = {});

}  // namespace mapping
