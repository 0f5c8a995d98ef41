#pragma once

#include <cstddef>

#include "levelset/adaptive/adaptive_field.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct AdaptiveToBandOptions {
  double halfWidth = 3;  ///< voxels, at least 1
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Converts an adaptive field to a band with the exact distances to its zero set, of which
/// adaptiveToMesh() gives the mesh. The band may be wider than the field.
/// @param voxelSize  world units; grid points lie at its integer multiples
/// @throws InvalidInput for a field without a zero set, and for a voxel larger than the solid
/// @throws ResourceLimit, Cancelled
[[nodiscard]] NarrowBand adaptiveToBand(const AdaptiveField& field, double voxelSize,
                                        const AdaptiveToBandOptions& options = {});

}  // namespace levelset
