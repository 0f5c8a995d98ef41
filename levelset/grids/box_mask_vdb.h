#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/vdb.h"

namespace levelset {

/// Sets all grid points of a box, a leaf at a time. Much faster than setting them one by one where
/// many boxes overlap.
/// @param box  in index space, both corners included
void addBox(openvdb::MaskTree& points, const openvdb::CoordBBox& box);

/// Sets the grid points of a ball.
/// @param radius  voxels, at least 0; points at this distance are included
void addBall(openvdb::MaskTree& points, const openvdb::Coord& centre, double radius);

}  // namespace levelset
