#pragma once

#include "levelset/narrow_band.h"
#include "levelset/shapes/shapes.h"
#include "mapping/generators/tiling.h"

namespace mapping {

enum class KnurlPattern {
  Diamond,   ///< two families of grooves that cross
  Diagonal,  ///< one family of grooves
  Straight   ///< grooves along y
};

/// A plate with V-grooves in its top, as pressed by knurling wheels [DIN82]. A tile of the diamond
/// pattern holds two diamonds for each column and row. Each column and each row of the straight
/// pattern is one pitch wide.
struct Knurl {
  KnurlPattern pattern = KnurlPattern::Diamond;
  double pitch = 1;  ///< distance of neighbouring grooves, measured across them, world units
  double depth = 0;  ///< depth of the grooves, world units; 0: sharpDepth()
  double flankAngle = 1.570796326795;  ///< radians between the two flanks of a groove
  /// Angle of the grooves from y, radians; ignored for straight grooves.
  double grooveAngle = 0.5235987756;
  double base = 0;  ///< thickness of the plate below the grooves, world units
  Tiling tiling = {};
};

/// Depth of the grooves at which the crests between them become sharp, world units.
[[nodiscard]] double sharpDepth(const Knurl& knurl);

[[nodiscard]] TileBox knurlBox(const Knurl& knurl, const Imath::V3d& center);
/// Bounds of the plate and its surface area, including the area of the grooves.
[[nodiscard]] levelset::ShapeExtent knurlExtent(const Knurl& knurl, const Imath::V3d& center);
/// Throws the usage and input errors of `makeKnurl` without building anything.
void checkKnurl(const Knurl& knurl, const Imath::V3d& center, double voxelSize,
                const levelset::ShapeOptions& options = {});

/// Builds a knurled plate with exact distances to all flanks, crests and sides.
/// @throws UsageError for lengths and angles out of range, and grooves deeper than sharp crests
///         allow
/// @throws InvalidInput for a pitch under two voxels
/// @throws ResourceLimit if the memory estimate exceeds the limit
/// @throws Cancelled if the progress callback cancels
[[nodiscard]] levelset::NarrowBand makeKnurl(const Knurl& knurl, const Imath::V3d& center,
                                             double voxelSize,
                                             const levelset::ShapeOptions& options = {});

}  // namespace mapping
