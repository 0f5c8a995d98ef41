#pragma once

#include "levelset/narrow_band.h"
#include "levelset/solids/shapes.h"
#include "mapping/generators/tiling.h"

namespace mapping {

enum class KnurlPattern {
  Diamond,   ///< two families of grooves that cross
  Diagonal,  ///< one of them
  Straight   ///< grooves along y
};

/// A plate with V-grooves in its top, as knurling wheels press them [DIN82]. A tile of the diamond
/// pattern holds two diamonds for each column and row; a tile of the straight one is a pitch long.
struct Knurl {
  KnurlPattern pattern = KnurlPattern::Diamond;
  double pitch = 1;                    ///< of neighbouring grooves, across them, world units
  double depth = 0;                    ///< of the grooves; 0: until the crests between are sharp
  double flankAngle = 1.570796326795;  ///< radians between the two flanks of a groove
  double grooveAngle = 0.5235987756;   ///< radians from y; straight grooves have none
  double base = 0;                     ///< of solid below the grooves
  Tiling tiling = {};
};

/// The depth at which crests become sharp.
[[nodiscard]] double sharpDepth(const Knurl& knurl);

[[nodiscard]] TileBox knurlBox(const Knurl& knurl, const Imath::V3d& center);
/// Bounds and area, of the grooves all of it.
[[nodiscard]] levelset::ShapeExtent knurlExtent(const Knurl& knurl, const Imath::V3d& center);
/// Refuses what `makeKnurl` would, before anything is made.
void checkKnurl(const Knurl& knurl, const Imath::V3d& center, double voxelSize,
                const levelset::ShapeOptions& options = {});

/// Exact distances to all flanks, crests and sides.
/// @throws UsageError for lengths and angles out of range and grooves deeper than sharp crests
///         allow; InvalidInput for a pitch or depth under two voxels; ResourceLimit; Cancelled
[[nodiscard]] levelset::NarrowBand makeKnurl(const Knurl& knurl, const Imath::V3d& center,
                                             double voxelSize,
                                             const levelset::ShapeOptions& options = {});

}  // namespace mapping
