#pragma once

// Private to the renderers: normal and curvature of a band at a point of its surface.

#include "levelset/vdb.h"

namespace render {

/// Positions in index space, φ in its own (world) unit.
struct SurfaceShape {
  Imath::V3d gradient;           ///< of the quasi-interpolating tricubic B-spline, per voxel
  Imath::V3d trilinearGradient;  ///< of the interpolant that the rays meet
  double hessian[3][3];          ///< of the B-spline
  double interpolationError;     ///< bound on |trilinear − smooth|, from second differences
};

/// At `position` (index space), from the 6³ grid values around it. The B-spline's coefficients are
/// f − ∇²f/6 by differences, which takes away the inward shift of a plain B-spline [Sigg05].
[[nodiscard]] SurfaceShape surfaceShape(const openvdb::FloatTree& tree, const Imath::V3d& position);

struct Curvatures {
  double mean, gauss, k1, k2;  ///< k1 ≥ k2; spheres positive
};

/// From gradient and Hessian of φ in any unit of length [Goldman05]. Zero where the gradient
/// vanishes.
[[nodiscard]] Curvatures curvaturesOf(const Imath::V3d& gradient, const double (&hessian)[3][3]);

}  // namespace render
