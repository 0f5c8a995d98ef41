#pragma once

// For the .cpp files of levelset/solids only.

#include "levelset/csg/seam_operands.h"

namespace levelset::solids {

/// Rounds the seam of `result`, the plain CSG of the operands, as a ball does that rolls along it.
///
/// With exact distances a, b of both solids the ball's centre runs along the curve a = b = r
/// outside. A grid point finds the point s of that curve that is nearest to it by Newton's method;
/// if it lies between the two radii from s to the points where the ball touches, its distance to
/// the fillet is r − |x − s|. Else nothing changes.
/// @param radius  world units, > 0
void addFillet(CsgOperation operation, const SeamOperands& operands, double radius,
               const BlendOptions& options, CsgResult& result);

}  // namespace levelset::solids
