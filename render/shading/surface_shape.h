#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include "render/hit.h"

namespace render {

/// Derivatives of a level set at a surface point. Positions are in index space, φ has its own
/// (world) unit.
struct SurfaceShape {
  Imath::V3d gradient{0};  ///< gradient of the quasi-interpolating tricubic B-spline, per voxel
  Imath::V3d trilinearGradient{0};  ///< gradient of the interpolant that the rays meet
  Imath::M33d hessian{0.0};         ///< second derivatives of the B-spline
  double interpolationError = 0;    ///< bound on |trilinear − smooth|, from second differences
};

/// Sets normals, curvatures and surface error of a hit. `isFlipped` of the hit must be set.
/// @param indexToWorld  a rotation with uniform scale, and a translation
/// @param direction  direction of the ray; where φ has no gradient, the normal faces it
void addShape(Hit& hit, const SurfaceShape& shape, const Imath::M44d& indexToWorld,
              const Imath::V3d& direction);

}  // namespace render
