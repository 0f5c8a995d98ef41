#pragma once

#include "apps/regress/truth/truth.h"
#include "levelset/narrow_band.h"

namespace regress {

/// The exact distance on the axis-aligned grid of integer multiples of `voxelSize`: what operators
/// are given, independent of any converter.
[[nodiscard]] levelset::NarrowBand exactBand(const Truth& truth, double voxelSize,
                                             double halfWidth = 3);

/// The band of a distance times 1.5 + 0.8 sin(x/4w) sin(y/4w) sin(z/4w), values clipped at the
/// background, on the voxels of the band of the distance: the same surface, slopes 0.7 to 2.3.
/// @param wave  w; the voxel size for waves that get shorter with the voxels
[[nodiscard]] levelset::NarrowBand perturbedBand(const Truth& truth, double voxelSize, double wave);

}  // namespace regress
