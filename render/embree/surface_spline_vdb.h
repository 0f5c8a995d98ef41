#pragma once

// Private to the judge: derivatives of a surface at a point, in double precision and from OpenVDB's
// own tree.

#include "levelset/vdb.h"
#include "render/filter.h"
#include "render/shading/surface_shape.h"

namespace render {

/// Computes the derivatives of φ at `position` (index space) from the 6³ grid values around it. The
/// B-spline's coefficients are f − ∇²f/6, with ∇² by second differences. They remove the inward
/// shift of a B-spline whose coefficients are the grid values f [Sigg05]. For Filter::BSpline the
/// coefficients are the grid values. For the spline filters, `trilinearGradient` is the gradient
/// of the spline and `interpolationError` is 0. The same holds for Filter::Tricubic, whose
/// derivatives are those of the Catmull-Rom spline.
[[nodiscard]] SurfaceShape surfaceShape(const openvdb::FloatTree& tree, const Imath::V3d& position,
                                        Filter filter);

}  // namespace render
