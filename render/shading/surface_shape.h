#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include "render/hit.h"

namespace render {

/// What a level set is like at a point of its surface: positions in index space, φ in its own
/// (world) unit.
struct SurfaceShape {
  Imath::V3d gradient{0};           ///< of the quasi-interpolating tricubic B-spline, per voxel
  Imath::V3d trilinearGradient{0};  ///< of the interpolant that the rays meet
  Imath::M33d hessian{0.0};         ///< of the B-spline
  double interpolationError = 0;    ///< bound on |trilinear − smooth|, from second differences
};

/// Fills in the normals and curvatures of a hit, and how far the surface may be off. `isFlipped` is
/// known before.
/// @param indexToWorld  a rotation with uniform scale, and a translation
/// @param direction     of the ray: what faces it is the normal where φ has no gradient
void addShape(Hit& hit, const SurfaceShape& shape, const Imath::M44d& indexToWorld,
              const Imath::V3d& direction);

}  // namespace render
