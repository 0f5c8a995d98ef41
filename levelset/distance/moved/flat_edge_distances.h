#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/vdb.h"

namespace levelset::eikonal {

/// Sets the distances beside edges between flat faces from the planes of the faces. Where a surface
/// moves back by the radius of its rounding, the rounding becomes an edge. Distances to the
/// rounding are less exact, since tricubic interpolation is off where the curvature jumps.
/// @param wrong  grid points whose value was not the distance to the zero set; some are beside each
///               such edge
/// @param halfWidth  voxels
void measureFlatEdges(openvdb::FloatGrid& field, const openvdb::MaskTree& wrong, double halfWidth);

}  // namespace levelset::eikonal
