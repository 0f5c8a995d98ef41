#pragma once

#include <Imath/ImathBox.h>

#include <cstddef>
#include <vector>

#include "render/bricks/field_grid.h"
#include "render/hit.h"
#include "render/scene/field_expression.h"
#include "render/scene/scene.h"

namespace render {

/// Intersects rays with the zero set of a scene's FieldExpression, for the kernel. Thread-safe. Ray
/// directions have unit length.
///
/// A ray traverses the cells of all grids at once. Between two cell faces all fields are cubic in
/// the ray parameter. Interval arithmetic bounds the expression and its slope there [Mitchell90].
/// Each interval is halved until the sign is certain or the expression is monotone. The search
/// remembers on which side of the surface the previous interval ended, so rounding at faces loses
/// no crossing.
class FieldTraversal {
 public:
  /// @pre the scene is blended and passes requireFields()
  /// @throws levelset::ResourceLimit when the fields need more than maxBytes or span too many
  /// voxels
  FieldTraversal(const Scene& scene, std::size_t maxBytes);
  /// Copies the transforms of the scene's solids. Returns true when a transform has changed.
  bool updateTransforms(const Scene& scene);

  [[nodiscard]] std::size_t bytes() const;
  [[nodiscard]] std::size_t blockCount() const;
  /// First hit in [near, far], distances along the ray in world units. The solid is where the
  /// expression is negative. A ray that is inside the solid at `near` hits where it leaves the
  /// solid.
  [[nodiscard]] Hit intersect(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                              double far) const;
  [[nodiscard]] bool isOccluded(const Imath::V3d& origin, const Imath::V3d& direction,
                                double maxDistance) const;
  /// Length of the ray within [near, far] where the expression is negative (inside), world units.
  [[nodiscard]] double thickness(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                                 double far) const;

 private:
  FieldExpression expression_;
  std::vector<FieldGrid> grids_;  // one for each operand of expression_
  Imath::Box3d box_;  // box of all fields, world space; outside it the expression is positive
};

}  // namespace render
