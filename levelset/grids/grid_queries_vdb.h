#pragma once

// Small queries and edits of level-set grids, for our own .cpp files.

#include "levelset/narrow_band.h"
#include "levelset/vdb.h"

namespace levelset {

/// Returns true when index positions of `a` and `b` map to the same world positions, as far as
/// either grid has active voxels. Tolerance: 1e-6 voxels.
[[nodiscard]] bool shareTransform(const openvdb::FloatGrid& a, const openvdb::FloatGrid& b);

/// Returns true when any voxel or tile is negative.
[[nodiscard]] bool hasInside(const openvdb::FloatGrid& grid);

/// Replaces nodes without active voxels, all of one sign, by tiles of the background.
void pruneOneSided(openvdb::FloatTree& tree);

/// Ends the band where |φ| reaches `background` (world units).
void endBandAt(openvdb::FloatGrid& grid, float background);

/// Returns the same field in a narrower band. A half width (voxels) that is not smaller changes
/// nothing.
[[nodiscard]] NarrowBand narrowed(NarrowBand band, double halfWidth);

}  // namespace levelset
