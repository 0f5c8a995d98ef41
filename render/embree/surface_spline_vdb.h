#pragma once

// Private to the judge: what a surface is like at a point, in double precision and from OpenVDB's
// own tree.

#include "levelset/vdb.h"
#include "render/filter.h"
#include "render/shading/surface_shape.h"

namespace render {

/// At `position` (index space), from the 6³ grid values around it. The B-spline's coefficients are
/// f − ∇²f/6 by differences, which takes away the inward shift of a plain B-spline [Sigg05]; those
/// of Filter::BSpline are the values. Where rays meet the spline nothing else is said of it.
[[nodiscard]] SurfaceShape surfaceShape(const openvdb::FloatTree& tree, const Imath::V3d& position,
                                        Filter filter);

}  // namespace render
