#pragma once

#include <Imath/ImathMatrix.h>

#include <optional>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct ResampleOptions {
  std::optional<double> halfWidth = {};  ///< of the result, voxels; empty: as the operand
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// How far beside the surface a solid is sampled, in its own voxels: a band that is too narrow is
/// made wider first.
/// @param ratio  voxel of the result to that of the solid
[[nodiscard]] double sampledWidth(double ratio);

/// The same solid on the axis-aligned grid of integer multiples of `voxelSize`: tricubic
/// (Catmull-Rom) where the source band allows, re-distanced towards the rim of the new band. Per
/// leaf block, so the bits do not depend on the number of threads.
[[nodiscard]] NarrowBand resample(const NarrowBand& solid, double voxelSize,
                                  const ResampleOptions& options = {});

/// The same, on the grid points of another transform (rotation, uniform scale, translation).
[[nodiscard]] NarrowBand resampleTo(const NarrowBand& solid, const Imath::M44d& indexToWorld,
                                    const ResampleOptions& options = {});

/// The same, on the grid points and with the half width of `like`.
[[nodiscard]] NarrowBand resampleLike(const NarrowBand& solid, const NarrowBand& like,
                                      const ResampleOptions& options = {});

/// True when both bands sit on the same grid points with the same half width.
[[nodiscard]] bool shareGrid(const NarrowBand& a, const NarrowBand& b);

}  // namespace levelset
