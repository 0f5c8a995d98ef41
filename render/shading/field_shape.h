#pragma once

#include <vector>

#include "render/hit.h"
#include "render/scene/field_expression.h"
#include "render/shading/surface_shape.h"

namespace render {

/// A field at a place: its value, and its shape in the world's axes and per world unit.
struct FieldShape {
  double value = 0;
  SurfaceShape shape;
};

/// The same of a grid, whose shape is told per voxel and in the axes of its own.
/// @param indexToWorld  a rotation with uniform scale, and a translation
[[nodiscard]] FieldShape fieldShape(double value, const SurfaceShape& shape,
                                    const Imath::M44d& indexToWorld);

/// Fills in what a hit shows of an expression's zero set: shape by the chain rule, the colours by
/// the parts that the solids have in it, and the id of the solid with the largest. `position` and
/// `distance` are known before.
/// @param operands   at the hit, in the expression's order
/// @param direction  of the ray
void addFieldShape(Hit& hit, const FieldExpression& expression,
                   const std::vector<FieldShape>& operands, const Imath::V3d& direction);

}  // namespace render
