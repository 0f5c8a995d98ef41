#pragma once

#include "apps/regress/truth/truth.h"
#include "levelset/narrow_band.h"

namespace regress {

/// Samples the exact distance on the axis-aligned grid of integer multiples of `voxelSize`.
/// Operators start from this band, which is independent of any converter.
[[nodiscard]] levelset::NarrowBand exactBand(const Truth& truth, double voxelSize,
                                             double halfWidth = 3);

/// Samples a distance times 1.5 + 0.8 sin(x/4w) sin(y/4w) sin(z/4w) on the voxels of the exact
/// band. Values are clipped at the background. The surface is unchanged, the slopes are 0.7 to 2.3.
/// @param wave  w; the voxel size gives waves that shorten with the voxels
[[nodiscard]] levelset::NarrowBand perturbedBand(const Truth& truth, double voxelSize, double wave);

}  // namespace regress
