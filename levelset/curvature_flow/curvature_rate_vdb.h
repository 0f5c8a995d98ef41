#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/grids/band_blocks_vdb.h"

namespace levelset::flow {

/// Computes κ|∇φ| − shift |∇φ| at the grid points of `rows` and their neighbours in the row, on
/// values in voxels; κ = k1 + k2.
/// Differences are of fourth order where the field is smooth. Beside creases the correction to
/// second order is bounded. Where the gradient vanishes, the direction of the strongest second
/// derivative replaces the normal. So the middle of a plate counts as flat, and that of a ball does
/// not.
void curvatureRate(const PaddedBlock& block, const BandBlocks::Mask& rows, float shift,
                   Values& rate);

/// Longest Euler step, voxels², that is stable with these differences, less a margin.
inline constexpr double kExplicitStep = 0.16;

}  // namespace levelset::flow
