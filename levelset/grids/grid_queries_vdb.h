#pragma once

// Small queries and edits of level-set grids, for the .cpp files of this library.

#include "levelset/narrow_band.h"
#include "levelset/vdb.h"

namespace levelset {

/// Returns true when equal index positions of `a` and `b` have equal world positions, within the
/// active bounds of both grids. Tolerance: 1e-6 voxels.
[[nodiscard]] bool shareTransform(const openvdb::FloatGrid& a, const openvdb::FloatGrid& b);

/// Returns true when a voxel or tile is negative.
[[nodiscard]] bool hasInside(const openvdb::FloatGrid& grid);

/// Replaces nodes by background tiles if they have no active voxels and all values have one sign.
void pruneOneSided(openvdb::FloatTree& tree);

/// Shortens the band to |φ| < `background` (world units).
void endBandAt(openvdb::FloatGrid& grid, float background);

/// Returns the same field in a narrower band, `halfWidth` in voxels. A half width that is not
/// smaller changes nothing.
[[nodiscard]] NarrowBand narrowed(NarrowBand band, double halfWidth);

}  // namespace levelset
