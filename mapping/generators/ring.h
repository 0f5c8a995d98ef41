#pragma once

#include <optional>

#include "levelset/narrow_band.h"
#include "levelset/solids/shapes.h"
#include "mapping/generators/tiling.h"

namespace mapping {

/// A ring that lies flat or leans, or a sheet of such rings as chain mail, European 4-in-1: rows
/// along x lean by turns to either side, every second row stands half a spacing aside, and each
/// ring holds two of the row before and two of the row behind.
struct Ring {
  double radius = 1;  ///< from its centre to the middle of its wire, world units
  double tube = 0.2;  ///< radius of round wire
  /// Of flat wire, in place of `tube`: across the ring, and along its axis.
  std::optional<Imath::V2d> section = {};
  /// Radians about x by which the axis leaves z towards −y, in the rows between towards +y. Empty:
  /// 0 for one ring, in sheets that which leaves most room between wires.
  std::optional<double> lean = {};
  int columns = 1, rows = 1;
  /// From ring to ring of a row, and from row to row. Empty: that which leaves most room.
  std::optional<Imath::V2d> spacing = {};
  double clearance = 0;  ///< that must be left between wires; two voxels in any case

  [[nodiscard]] bool isSheet() const { return columns > 1 || rows > 1; }
};

/// Of ring (column, row), in a frame whose origin is the centre of ring (0, 0).
[[nodiscard]] Imath::V3d ringCenter(const Ring& ring, int column, int row);
/// Radians about x.
[[nodiscard]] double ringLean(const Ring& ring, int row);

/// What is left between the wires of any two rings of the sheet; HUGE_VAL for one ring. Flat wire
/// counts as round wire about its corners. Negative where wires meet.
[[nodiscard]] double ringClearance(const Ring& ring);

/// The tile is what repeats: whole spacings, two rows at a time.
[[nodiscard]] TileBox ringBox(const Ring& ring, const Imath::V3d& center);
[[nodiscard]] levelset::ShapeExtent ringExtent(const Ring& ring, const Imath::V3d& center);
void checkRing(const Ring& ring, const Imath::V3d& center, double voxelSize,
               const levelset::ShapeOptions& options = {});

/// Exact distances. @param center  of the box of all rings
/// @throws UsageError for lengths and angles out of range, rings that touch or do not hold each
///         other; InvalidInput for wire under two voxels or less than two voxels between wires;
///         ResourceLimit; Cancelled
[[nodiscard]] levelset::NarrowBand makeRing(const Ring& ring, const Imath::V3d& center,
                                            double voxelSize,
                                            const levelset::ShapeOptions& options = {});

}  // namespace mapping
