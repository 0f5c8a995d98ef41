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
/// The interval is halved until the sign is certain or the expression is monotone. The side of the
/// surface is carried from interval to interval, so rounding at faces loses no crossing.
class FieldTraversal {
 public:
  /// @pre the scene is blended and passes requireFields()
  /// @throws levelset::ResourceLimit when the fields need more than maxBytes or span too many
  ///         blocks
  FieldTraversal(const Scene& scene, std::size_t maxBytes);
  /// Reads the transforms of the solids again. Returns true when one has moved.
  bool updateTransforms(const Scene& scene);

  [[nodiscard]] std::size_t bytes() const;
  [[nodiscard]] std::size_t blockCount() const;
  /// First hit in [near, far]. A ray that is inside at `near` hits where it leaves.
  [[nodiscard]] Hit intersect(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                              double far) const;
  [[nodiscard]] bool isOccluded(const Imath::V3d& origin, const Imath::V3d& direction,
                                double maxDistance) const;
  /// Length of the ray inside the solid within [near, far], world units.
  [[nodiscard]] double thickness(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                                 double far) const;

 private:
  FieldExpression expression_;
  std::vector<FieldGrid> grids_;  // one for each operand
  Imath::Box3d box_;              // outside it the expression is positive
};

}  // namespace render
