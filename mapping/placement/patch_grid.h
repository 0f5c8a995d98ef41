#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <vector>

#include "levelset/narrow_band.h"
#include "mapping/placement/make_patch.h"

namespace mapping {

/// How a texture is tiled.
struct PatchGridOptions {
  std::size_t columns = 1, rows = 1;  ///< tiles along u and v, each at least 1
  bool mirrorU = false;               ///< every other column of tiles runs the other way along u
  bool mirrorV = false;               ///< every other row of tiles runs the other way along v
  /// Every other row is moved along u by this share of a tile, 0 to below 1, to the nearest
  /// particle. Such a row of an open grid has one tile less.
  double shift = 0;
};

struct PatchGridResult {
  std::vector<Patch> patches;  ///< row by row, along u first
  PatchReport report;          ///< of all tiles together
};

/// Tiles of one patch between four corners, see makePatch. Neighbours share the particles of their
/// common border, bit for bit, and each tile's rim lies on its neighbours' particles: textures that
/// meet at the borders of their boxes meet on the surface. Layers have equal counts of particles.
/// @throws as makePatch; UsageError for counts of 0, and a shift out of range
[[nodiscard]] PatchGridResult makePatchGrid(const levelset::NarrowBand& base,
                                            const std::array<Imath::V3d, 4>& corners, double height,
                                            const PatchGridOptions& grid,
                                            const PatchOptions& options = {});

/// Tiles all around an axis, between the planes across it through its two ends: u runs around,
/// anticlockwise seen from `to`, v from `from` to `to`; the last column meets the first. The
/// surface is what is seen from outside along lines at right angles to the axis.
/// @param from, to  on the axis, apart; a solid of revolution has its own
/// @param rotation  of the first seam about the axis, radians, from the direction that is nearest
///                  to +x (or +y along x)
/// @throws UsageError also for less than 3 columns, or mirrorU with an odd number of them;
///         InvalidInput where no surface lies around the axis, or where it is not one sheet
[[nodiscard]] PatchGridResult makePatchGridAround(const levelset::NarrowBand& base,
                                                  const Imath::V3d& from, const Imath::V3d& to,
                                                  double rotation, double height,
                                                  const PatchGridOptions& grid,
                                                  const PatchOptions& options = {});

}  // namespace mapping
