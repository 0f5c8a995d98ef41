#pragma once

#include "levelset/progress.h"
#include "levelset/volumes/filters/volume_filter.h"
#include "levelset/volumes/volume.h"

namespace levelset {

struct ResampleVolumeOptions {
  VolumeFilter filter = VolumeFilter::Tricubic;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Grid of a resampled volume: its points lie at integer multiples of `spacing` and cover the
/// bounds of `grid`.
/// @param spacing  distance between neighbouring grid points along each axis, world units
/// @throws UsageError for a spacing that is not positive or above 1e30; ResourceLimit when the
/// indices
///         exceed 32 bits
[[nodiscard]] VolumeGrid resampledGrid(const VolumeGrid& grid, double spacing);

/// Samples a volume on an axis-aligned grid of cubes, resampledGrid(). The result has the type f32.
/// Points outside the volume take the value of the nearest point of its border in index space. The
/// filter reconstructs the function between the samples. It removes no detail: before a coarser
/// grid, use blurred(), or detail finer than two spacings becomes false coarse detail.
/// @throws as resampledGrid(); ResourceLimit also for the memory of the result; Cancelled
[[nodiscard]] Volume resampled(const Volume& volume, double spacing,
                               const ResampleVolumeOptions& options = {});

}  // namespace levelset
