#pragma once

#include <Imath/ImathMatrix.h>

#include "levelset/segmented/segmented_field.h"

namespace levelset {

/// Moves a partition exactly, by changing its grid transform. A uniform scale also scales the
/// distances. Sheets move with it.
/// @param matrix  rotation, uniform scale, translation; world' = world * matrix, with Imath's row
///                vectors
/// @throws UsageError if the matrix is not affine and invertible
/// @throws InvalidInput if the matrix shears, mirrors or scales unevenly, or if the partition is
///         default-constructed or moves too far from the origin for its voxels
[[nodiscard]] SegmentedField placeSegmented(const SegmentedField& field, const Imath::M44d& matrix);

}  // namespace levelset
