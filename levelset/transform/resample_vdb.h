#pragma once

// Resampling of a solid on another grid, and helpers for grid transforms. Includes OpenVDB: for
// .cpp files only.

#include "levelset/transform/resample.h"
#include "levelset/vdb.h"

namespace levelset {

/// Resamples a solid on the grid with the index-to-world matrix `targetToWorld` and re-distances
/// the result. Uses `sourceToWorld` in place of the index-to-world matrix of the solid.
/// @param sourceToWorld  any invertible affine matrix
/// @param targetToWorld  rotation, uniform scale, translation
/// @param halfWidth      half width of the result, voxels
/// @throws as resample()
[[nodiscard]] NarrowBand resampleField(const NarrowBand& solid, const Imath::M44d& sourceToWorld,
                                       const Imath::M44d& targetToWorld, double halfWidth,
                                       std::size_t maxMemory, const Progress& progress);

/// Checks a voxel size.
/// @throws UsageError unless it is positive and finite
void requireVoxelSize(double voxelSize);

/// Converts a matrix to an OpenVDB transform.
/// @throws ResourceLimit if the voxels are so small that OpenVDB rejects the matrix as singular
[[nodiscard]] openvdb::math::Transform::Ptr transformOf(const Imath::M44d& indexToWorld);

/// Index-to-world matrix of the axis-aligned grid with a grid point at the world origin.
[[nodiscard]] Imath::M44d axisAligned(double voxelSize);

/// Smallest and largest singular value of the linear part of a matrix: the factors by which it
/// scales lengths.
struct Stretch {
  double least, greatest;
};
[[nodiscard]] Stretch stretchOf(const Imath::M44d& matrix);

}  // namespace levelset
