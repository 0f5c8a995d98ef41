#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include "render/hit.h"

namespace render {

/// Derivatives of a level set at a surface point. Positions are in index space; φ is in world
/// units.
struct SurfaceShape {
  /// Gradient of a tricubic B-spline, φ per voxel; quasi-interpolating unless the filter is
  /// BSpline.
  Imath::V3d gradient{0};
  /// Gradient of the interpolant whose zero set is drawn (trilinear, or the B-spline), φ per voxel.
  Imath::V3d trilinearGradient{0};
  Imath::M33d hessian{0.0};  ///< second derivatives of the B-spline of `gradient`, φ per voxel²
  /// Bound on the difference between φ as drawn (trilinear) and a smooth function with the same
  /// grid values, world units; 0 for a spline filter.
  double interpolationError = 0;
};

/// Sets normals, curvatures and surface error of a hit. @pre `isFlipped` of the hit is set
/// @param indexToWorld  a rotation with uniform scale, and a translation
/// @param direction  direction of the ray; the normal is −direction where the gradient of φ
/// vanishes
void addShape(Hit& hit, const SurfaceShape& shape, const Imath::M44d& indexToWorld,
              const Imath::V3d& direction);

/// The same for the field of a volume, whose grid may be anisotropic or sheared and whose gradient
/// may have any length.
/// @param shape  derivatives per grid spacing
/// @param worldToIndex  any invertible affine map
/// @param voxelSize  largest value of the surface error, world units
void addVolumeShape(Hit& hit, const SurfaceShape& shape, const Imath::M44d& worldToIndex,
                    double voxelSize, const Imath::V3d& direction);

}  // namespace render
