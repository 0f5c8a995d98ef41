#pragma once

#include <Imath/ImathVec.h>

#include <array>

#include "levelset/narrow_band.h"
#include "levelset/solids/shapes.h"
#include "mapping/generators/tiling.h"

namespace mapping {

enum class GyroidKind {
  Sheet,   ///< a wall along the surface between two labyrinths of equal shape
  Network  ///< the struts of one labyrinth
};

/// The layer surface sin x cos y + sin y cos z + sin z cos x = 0, which is near Schoen's minimal
/// surface [Schoen70, Wohlgemuth01], cut off by the box of its cells.
struct Gyroid {
  GyroidKind kind = GyroidKind::Sheet;
  double cell = 1;         ///< edge of a cubic cell, world units
  double thickness = 0.1;  ///< of the wall everywhere, or of struts where they are thinnest
  std::array<int, 3> cells = {1, 1, 1};  ///< along x, y and z
};

/// Thickest walls and struts, in cells: beyond, a labyrinth closes at its necks.
inline constexpr double kThickestGyroidWall = 0.2449, kThickestGyroidStrut = 0.4898;

/// Signed distance from the surface itself, world units: at a position from a corner of a cell, to
/// within rounding where it is less than an eighth of a cell; positive where the formula is.
[[nodiscard]] double gyroidDistance(const Imath::V3d& position, double cell);

[[nodiscard]] TileBox gyroidBox(const Gyroid& gyroid, const Imath::V3d& center);
[[nodiscard]] levelset::ShapeExtent gyroidExtent(const Gyroid& gyroid, const Imath::V3d& center);
void checkGyroid(const Gyroid& gyroid, const Imath::V3d& center, double voxelSize,
                 const levelset::ShapeOptions& options = {});

/// @throws UsageError for lengths out of range and thicknesses that close a labyrinth; InvalidInput
///         for walls, struts or openings under two voxels; ResourceLimit; Cancelled
[[nodiscard]] levelset::NarrowBand makeGyroid(const Gyroid& gyroid, const Imath::V3d& center,
                                              double voxelSize,
                                              const levelset::ShapeOptions& options = {});

}  // namespace mapping
