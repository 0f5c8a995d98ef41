#pragma once

#include <Imath/ImathMatrix.h>

#include "render/hit.h"
#include "render/shading/surface_shape.h"

namespace render {

/// Sets CurvatureSample::direction1 of a hit. It takes as long as addShape(), so it is a function
/// of its own. @pre addShape() has been called with the same shape and map
void addDirection(Hit& hit, const SurfaceShape& shape, const Imath::M44d& indexToWorld);

/// The same after addVolumeShape().
void addVolumeDirection(Hit& hit, const SurfaceShape& shape, const Imath::M44d& worldToIndex);

}  // namespace render
