#pragma once

// For the .cpp files of levelset/csg only.

#include "levelset/csg/seam_operands.h"

namespace levelset::solids {

/// Rounds the seam of `result`, the plain CSG of the operands, with a rolling-ball fillet.
///
/// Let a and b be the exact distances to both solids, and r the radius. The centre of the ball
/// moves along the spine curve a = b = r outside the solids. Newton's method finds the point s of
/// this curve nearest to a grid point x. If x lies between the two radii from s to the contact
/// points of the ball, the distance from x to the fillet is r − |x − s|. Otherwise the value at x
/// does not change.
/// @param radius  world units, > 0
void addFillet(CsgOperation operation, const SeamOperands& operands, double radius,
               const BlendOptions& options, CsgResult& result);

}  // namespace levelset::solids
