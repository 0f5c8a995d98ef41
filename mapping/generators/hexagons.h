#pragma once

#include "levelset/narrow_band.h"
#include "levelset/solids/shapes.h"
#include "mapping/generators/tiling.h"

namespace mapping {

enum class HexagonKind {
  Raised,    ///< six-sided pillars with gaps between them
  Honeycomb  ///< walls between six-sided cells
};

/// Hexagons with flats across x, in rows along x of which every second one stands half a spacing
/// aside, on a plate or without one. An even number of rows goes on across its tile's sides.
struct Hexagons {
  HexagonKind kind = HexagonKind::Raised;
  double size = 1;      ///< of a hexagon across its flats, world units
  double gap = 0.2;     ///< between hexagons; the thickness of a honeycomb's walls
  double height = 0.5;  ///< above the plate
  double base = 0.2;    ///< thickness of the plate; 0: pillars apart, cells open at both ends
  double rounding = 0;  ///< radius of the upper edges, of raised hexagons along their corners too
  Tiling tiling = {};
};

[[nodiscard]] TileBox hexagonsBox(const Hexagons& hexagons, const Imath::V3d& center);
[[nodiscard]] levelset::ShapeExtent hexagonsExtent(const Hexagons& hexagons,
                                                   const Imath::V3d& center);
void checkHexagons(const Hexagons& hexagons, const Imath::V3d& center, double voxelSize,
                   const levelset::ShapeOptions& options = {});

/// @throws UsageError for lengths out of range, a rounding that is wider than half of what it
///         rounds; InvalidInput for a size or gap under two voxels; ResourceLimit; Cancelled
[[nodiscard]] levelset::NarrowBand makeHexagons(const Hexagons& hexagons, const Imath::V3d& center,
                                                double voxelSize,
                                                const levelset::ShapeOptions& options = {});

}  // namespace mapping
