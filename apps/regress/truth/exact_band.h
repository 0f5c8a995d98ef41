#pragma once

#include "apps/regress/truth/truth.h"
#include "levelset/narrow_band.h"

namespace regress {

/// Samples the exact distance on the axis-aligned grid of integer multiples of `voxelSize`.
/// Operators of the suite start from this band, which does not depend on the conversion code under
/// test.
[[nodiscard]] levelset::NarrowBand exactBand(const Truth& truth, double voxelSize,
                                             double halfWidth = 3);

/// Samples a distance times 1.5 + 0.8 sin(x/4w) sin(y/4w) sin(z/4w) on the voxels of the exact
/// band. Values are clipped at the background. The surface is unchanged; its slopes |∇φ| are 0.7 to
/// 2.3.
/// @param wave  length w of the formula, world units; with the voxel size as w, finer voxels have
///         shorter waves
[[nodiscard]] levelset::NarrowBand perturbedBand(const Truth& truth, double voxelSize, double wave);

}  // namespace regress
