#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <vector>

#include "levelset/narrow_band.h"
#include "mapping/placement/make_patch.h"

namespace mapping {

/// Tiling of a texture over one patch.
struct PatchGridOptions {
  std::size_t columns = 1, rows = 1;  ///< tiles along u and v, each at least 1
  bool mirrorU = false;               ///< every second column of tiles is mirrored along u
  bool mirrorV = false;               ///< every second row of tiles is mirrored along v
  /// Shift of every second row along u, as a share of a tile from 0 to below 1, rounded to the
  /// nearest particle. In an open grid such a row has one tile less.
  double shift = 0;
};

struct PatchGridResult {
  std::vector<Patch> patches;  ///< row by row, along u first
  PatchReport report;          ///< measurements over all tiles
};

/// Builds the tiles of one patch between four corners, see makePatch. Neighbouring tiles share the
/// particles of their common border bit for bit, and the rim of each tile lies on its neighbours'
/// particles. So textures that match at the borders of their boxes match on the surface. All layers
/// have equal particle counts.
/// @throws UsageError as makePatch, and for counts of 0 and a shift out of range
/// @throws InvalidInput as makePatch
[[nodiscard]] PatchGridResult makePatchGrid(const levelset::NarrowBand& base,
                                            const std::array<Imath::V3d, 4>& corners, double height,
                                            const PatchGridOptions& grid,
                                            const PatchOptions& options = {});

/// Builds tiles all around an axis, between the two planes through its ends that are perpendicular
/// to it. The direction of u is around the axis, anticlockwise seen from `to`. The direction of v
/// is from `from` to `to`. The last column of tiles joins the first. The tiles lie on the part of
/// the surface that is visible from outside along lines perpendicular to the axis.
/// @param from, to  different points on the axis; a solid of revolution has its own axis
/// @param rotation  angle about the axis at which the first column of tiles begins, radians. It is
///         measured from the perpendicular direction nearest to +x (or to +y for an axis within 26°
///         of x).
/// @throws UsageError as makePatchGrid, for fewer than 3 columns, and for mirrorU with an odd
///         number of columns
/// @throws InvalidInput where no surface lies around the axis, or where the visible surface jumps
///         from one part to another
[[nodiscard]] PatchGridResult makePatchGridAround(const levelset::NarrowBand& base,
                                                  const Imath::V3d& from, const Imath::V3d& to,
                                                  double rotation, double height,
                                                  const PatchGridOptions& grid,
                                                  const PatchOptions& options = {});

}  // namespace mapping
