#pragma once

#include "levelset/narrow_band.h"
#include "levelset/shapes/shapes.h"
#include "mapping/generators/tiling.h"

namespace mapping {

enum class HexagonKind {
  Raised,    ///< hexagonal pillars with gaps between them
  Honeycomb  ///< walls between hexagonal cells
};

/// Hexagons with flats across x, in rows along x, with or without a plate. Every second row is
/// shifted by half a spacing. With an even number of rows the pattern continues across the sides of
/// its tile.
struct Hexagons {
  HexagonKind kind = HexagonKind::Raised;
  double size = 1;      ///< width of a hexagon across its flats, world units
  double gap = 0.2;     ///< gap between hexagons, or thickness of a honeycomb's walls
  double height = 0.5;  ///< height above the plate
  double base = 0.2;    ///< thickness of the plate; 0: separate pillars, or cells open at both ends
  /// Rounding radius of the upper edges, and of the upright edges of raised hexagons.
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
///         width of pillars or walls
/// @throws InvalidInput for a size or gap under two voxels
/// @throws ResourceLimit if the memory estimate exceeds the limit
/// @throws Cancelled if the progress callback cancels
[[nodiscard]] levelset::NarrowBand makeHexagons(const Hexagons& hexagons, const Imath::V3d& center,
                                                double voxelSize,
                                                const levelset::ShapeOptions& options = {});

}  // namespace mapping
