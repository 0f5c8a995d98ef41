#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/grids/band_blocks_vdb.h"

namespace levelset::flow {

/// κ|∇φ| − shift |∇φ| at the grid points of `rows` and their neighbours in the row, κ = k1 + k2, on
/// values in voxels. Differences of fourth order where the field is smooth; beside creases the
/// correction to second order is bounded. Where the gradient vanishes the direction of the
/// strongest second derivative takes the place of the normal: the middle of a plate is flat, that
/// of a ball is not.
void curvatureRate(const PaddedBlock& block, const BandBlocks::Mask& rows, float shift,
                   Values& rate);

/// Greatest Euler step, voxels², that is stable with these differences, with some air.
inline constexpr double kExplicitStep = 0.16;

}  // namespace levelset::flow
