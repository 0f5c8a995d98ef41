#pragma once

#include <optional>

#include "levelset/narrow_band.h"
#include "levelset/shapes/shapes.h"
#include "mapping/generators/tiling.h"

namespace mapping {

/// A single ring, flat or leaning, or a sheet of rings as European 4-in-1 chain mail. Rows along x
/// lean alternately to either side, and every second row is shifted by half a spacing. Each ring is
/// linked with two rings of the previous row and two of the next row.
struct Ring {
  double radius = 1;  ///< distance from the ring's centre to the middle of its wire, world units
  double tube = 0.2;  ///< radius of round wire, world units
  /// Section of flat wire, which replaces `tube`: width across the ring, and height along its axis,
  /// world units.
  std::optional<Imath::V2d> section = {};
  /// Angle about x by which the axis leans from z towards −y, and towards +y in every second row;
  /// radians. Empty: 0 for a single ring; in sheets the angle with the largest clearance.
  std::optional<double> lean = {};
  int columns = 1, rows = 1;
  /// Distance between the rings of a row, and between rows, world units. Empty: the spacing with
  /// the largest clearance.
  std::optional<Imath::V2d> spacing = {};
  /// Required clearance between wires, world units; at least two voxels in any case.
  double clearance = 0;

  [[nodiscard]] bool isSheet() const { return columns > 1 || rows > 1; }
};

/// Centre of ring (column, row), world units, in a frame whose origin is the centre of ring (0, 0).
[[nodiscard]] Imath::V3d ringCenter(const Ring& ring, int column, int row);
/// Lean of a row about x, radians.
[[nodiscard]] double ringLean(const Ring& ring, int row);

/// Least clearance between the wires of any two rings of the sheet, world units; HUGE_VAL for one
/// ring. Flat wire counts as round wire through the corners of its section. Negative if wires
/// overlap.
[[nodiscard]] double ringClearance(const Ring& ring);

/// Boxes `tile` and `whole` of the rings. The tile of a sheet is `columns` by `rows` spacings; with
/// an even number of rows the sheet repeats after one tile. The tile of a single ring is its
/// bounding box.
[[nodiscard]] TileBox ringBox(const Ring& ring, const Imath::V3d& center);
[[nodiscard]] levelset::ShapeExtent ringExtent(const Ring& ring, const Imath::V3d& center);
void checkRing(const Ring& ring, const Imath::V3d& center, double voxelSize,
               const levelset::ShapeOptions& options = {});

/// Builds a ring or sheet with exact distances.
/// @param center  centre of the bounding box of all rings
/// @throws UsageError for lengths and angles out of range, and rings that touch or are not linked
/// @throws InvalidInput for wire under two voxels, or less than two voxels between wires
/// @throws ResourceLimit if the memory estimate exceeds the limit
/// @throws Cancelled if the progress callback cancels
[[nodiscard]] levelset::NarrowBand makeRing(const Ring& ring, const Imath::V3d& center,
                                            double voxelSize,
                                            const levelset::ShapeOptions& options = {});

}  // namespace mapping
