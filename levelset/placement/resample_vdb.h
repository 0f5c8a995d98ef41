#pragma once

// The resampling kernel, for our own .cpp files.

#include "levelset/placement/resample.h"
#include "levelset/vdb.h"

namespace levelset {

/// Reads the samples of `solid` as if its indices sat at `sourceToWorld`, on the grid points of
/// `targetToWorld`, and makes distances of them.
/// @param sourceToWorld  any invertible affine matrix
/// @param targetToWorld  rotation, uniform scale, translation
/// @param halfWidth      of the result, voxels
[[nodiscard]] NarrowBand resampleField(const NarrowBand& solid, const Imath::M44d& sourceToWorld,
                                       const Imath::M44d& targetToWorld, double halfWidth,
                                       std::size_t maxMemory, const Progress& progress,
                                       const char* action);

/// @throws UsageError unless positive and finite
void requireVoxelSize(double voxelSize, const char* action);

/// @throws ResourceLimit for voxels so small that OpenVDB takes the matrix for singular
[[nodiscard]] openvdb::math::Transform::Ptr transformOf(const Imath::M44d& indexToWorld,
                                                        const char* action);

[[nodiscard]] Imath::M44d axisAligned(double voxelSize);

/// Least and greatest stretch of the matrix' linear part.
struct Stretch {
  double least, greatest;
};
[[nodiscard]] Stretch stretchOf(const Imath::M44d& matrix);

}  // namespace levelset
