#pragma once

#include <Imath/ImathVec.h>

#include <array>

#include "levelset/narrow_band.h"
#include "levelset/shapes/shapes.h"
#include "mapping/generators/tiling.h"

namespace mapping {

enum class GyroidKind {
  Sheet,   ///< a wall along the surface between two congruent labyrinths
  Network  ///< the struts of one labyrinth
};

/// The surface sin x cos y + sin y cos z + sin z cos x = 0, with a period of one cell per 2π,
/// clipped by the box of its cells. It approximates Schoen's minimal surface [Schoen70,
/// Wohlgemuth01].
struct Gyroid {
  GyroidKind kind = GyroidKind::Sheet;
  double cell = 1;         ///< edge of a cubic cell, world units
  double thickness = 0.1;  ///< thickness of the wall, or of struts at their thinnest; world units
  std::array<int, 3> cells = {1, 1, 1};  ///< number of cells along x, y and z
};

/// Thickness at which walls and struts close the necks of a labyrinth, as a multiple of the cell
/// edge. A valid thickness is smaller.
inline constexpr double kThickestGyroidWall = 0.2449, kThickestGyroidStrut = 0.4898;

/// Signed distance to the gyroid surface, world units, positive where sin x cos y + sin y cos z +
/// sin z cos x > 0. It is exact within rounding errors up to a distance of an eighth of a cell.
/// @param position  relative to a corner of a cell, world units
/// @param cell      edge of a cell, world units
[[nodiscard]] double gyroidDistance(const Imath::V3d& position, double cell);

[[nodiscard]] TileBox gyroidBox(const Gyroid& gyroid, const Imath::V3d& center);
[[nodiscard]] levelset::ShapeExtent gyroidExtent(const Gyroid& gyroid, const Imath::V3d& center);
void checkGyroid(const Gyroid& gyroid, const Imath::V3d& center, double voxelSize,
                 const levelset::ShapeOptions& options = {});

/// Builds a gyroid.
/// @throws UsageError for lengths out of range, and a thickness that closes a labyrinth
/// @throws InvalidInput for walls, struts or openings under two voxels
/// @throws ResourceLimit if the memory estimate exceeds the limit
/// @throws Cancelled if the progress callback cancels
[[nodiscard]] levelset::NarrowBand makeGyroid(const Gyroid& gyroid, const Imath::V3d& center,
                                              double voxelSize,
                                              const levelset::ShapeOptions& options = {});

}  // namespace mapping
