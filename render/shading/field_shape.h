#pragma once

#include <vector>

#include "render/hit.h"
#include "render/scene/field_expression.h"
#include "render/shading/surface_shape.h"

namespace render {

/// Value of a field at a point, world units, and its derivatives along world axes, per world unit.
struct FieldShape {
  double value = 0;
  SurfaceShape shape;
};

/// Converts the derivatives of a grid at a point from index space to world space.
/// @param indexToWorld  a rotation with uniform scale, and a translation
[[nodiscard]] FieldShape fieldShape(double value, const SurfaceShape& shape,
                                    const Imath::M44d& indexToWorld);

/// Completes a hit on the zero set of an expression. The derivatives of the expression follow from
/// those of the fields by the chain rule. Each solid contributes by the derivative of the
/// expression by its field. The contributions weight the colours, and the id is that of the solid
/// with the largest one. `position` and `distance` of the hit must be set.
/// @param operands  values and derivatives of the fields at the hit, in the order of
/// FieldExpression::operands
/// @param direction  direction of the ray
void addFieldShape(Hit& hit, const FieldExpression& expression,
                   const std::vector<FieldShape>& operands, const Imath::V3d& direction);

}  // namespace render
