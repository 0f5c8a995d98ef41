#pragma once

#include "levelset/narrow_band.h"
#include "levelset/shapes/shapes.h"
#include "mapping/generators/tiling.h"

namespace mapping {

enum class HexagonKind {
  Raised,    ///< hexagonal pillars with gaps between them
  Honeycomb  ///< walls between hexagonal cells
};

/// Hexagons with two sides perpendicular to x, in rows along x, with or without a plate below them.
/// Every second row is shifted by half a spacing. With an even number of rows the pattern continues
/// across the sides of its tile.
struct Hexagons {
  HexagonKind kind = HexagonKind::Raised;
  double size = 1;      ///< distance of opposite sides of a hexagon, world units
  double gap = 0.2;     ///< gap between hexagons, or thickness of honeycomb walls; world units
  double height = 0.5;  ///< height of the hexagons or walls above the plate, world units
  /// Thickness of the plate, world units. 0: no plate; pillars are separate, and honeycomb cells
  /// are open at both ends.
  double base = 0.2;
  /// Rounding radius of the upper edges, and of the upright edges of raised hexagons; world units.
  double rounding = 0;
  Tiling tiling = {};
};

[[nodiscard]] TileBox hexagonsBox(const Hexagons& hexagons, const Imath::V3d& center);
[[nodiscard]] levelset::ShapeExtent hexagonsExtent(const Hexagons& hexagons,
                                                   const Imath::V3d& center);
void checkHexagons(const Hexagons& hexagons, const Imath::V3d& center, double voxelSize,
                   const levelset::ShapeOptions& options = {});

/// Builds hexagons.
/// @throws UsageError for lengths out of range, and a rounding larger than the height or half the
///         width of pillars or honeycomb walls
/// @throws InvalidInput for a size or gap under two voxels
/// @throws ResourceLimit if the memory estimate exceeds the limit
/// @throws Cancelled if the progress callback cancels
[[nodiscard]] levelset::NarrowBand makeHexagons(const Hexagons& hexagons, const Imath::V3d& center,
                                                double voxelSize,
                                                const levelset::ShapeOptions& options = {});

}  // namespace mapping
