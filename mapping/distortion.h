#pragma once

#include <Imath/ImathVec.h>

#include "mapping/patch.h"
#include "mapping/rbf_map.h"

namespace mapping {

/// What a map does to lengths and volumes, sampled at all particles, at the middles of their cells,
/// between the levels, and below the surface as deep as the texture is sunk.
struct Distortion {
  double minJacobian = 0;  ///< det ∇Φ × mean volume of patch space; 1 for a box, ≤ 0 folds
  Imath::V3d foldPlace{0}, foldUvw{0};    ///< where that is, in world and texture coordinates
  double minStretch = 0, maxStretch = 0;  ///< singular values of texture → patch, world per world
  double meanStretch = 0;                 ///< third root of the mean volume ratio
};

/// @param textureSize  of the box that is the unit cube, world units
/// @param sink         how deep the texture reaches below the surface, in w
[[nodiscard]] Distortion surveyDistortion(const RbfMap& map, const Patch& patch,
                                          const Imath::V3d& textureSize, double sink = 0);

}  // namespace mapping
