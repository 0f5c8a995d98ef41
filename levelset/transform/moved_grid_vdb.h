#pragma once

#include "levelset/vdb.h"

// Private to levelset. Includes OpenVDB, so include it from .cpp files only.

namespace levelset {

/// Grid transform of a value that moves by a matrix.
struct MovedGrid {
  openvdb::math::Transform::Ptr transform;
  /// Factor of all distances. Exactly 1 for a rotation, which keeps the bits of the distances.
  double scale = 1;
  float background = 0;  ///< half width, world units
};

/// Moves a grid exactly.
/// @param voxelSize  world units
/// @param halfWidth  voxels
/// @param advice     ends the message for a matrix that is no similarity: what to do instead
/// @throws UsageError if the matrix is not affine and invertible
/// @throws InvalidInput if the matrix shears, mirrors or scales unevenly, or if the grid moves too
///         far from the origin for its voxels
[[nodiscard]] MovedGrid movedGrid(const Imath::M44d& indexToWorld, double voxelSize,
                                  double halfWidth, const Imath::M44d& matrix, const char* advice);

}  // namespace levelset
