#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/grids/band_blocks_vdb.h"

namespace levelset::flow {

/// Computes κ|∇φ| − shift |∇φ|, with κ = k1 + k2 and φ in voxels, at the grid points of the mask
/// `rows`. Processes four neighbouring grid points along z at once, so it also writes rates of grid
/// points next to those of the mask. Differences are of fourth order where the field is smooth. The
/// deviation from second-order differences is bounded, which takes effect beside creases. Where the
/// gradient vanishes, the direction of the strongest second derivative replaces the normal. So the
/// rate is zero in the middle of a plate, but not in the centre of a ball.
void curvatureRate(const PaddedBlock& block, const BandBlocks::Mask& rows, float shift,
                   Values& rate);

/// Longest Euler step that is stable with the differences of curvatureRate(), less a margin,
/// voxels².
inline constexpr double kExplicitStep = 0.16;

}  // namespace levelset::flow
