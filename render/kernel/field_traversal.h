#pragma once

#include <Imath/ImathBox.h>

#include <cstddef>
#include <vector>

#include "render/bricks/field_grid.h"
#include "render/hit.h"
#include "render/scene/field_expression.h"
#include "render/scene/scene.h"

namespace render {

/// The zero set of a scene's FieldExpression for the kernel's rays: a walk over the cells of all
/// grids at once, and in each part of the ray between their faces, where all fields are cubics,
/// bounds of the expression and of its slope by intervals [Mitchell90], halving until a sign is
/// certain or the expression is monotone. The side that a ray is on is carried from part to part,
/// so that rounding at faces loses no crossing. Thread-safe. Rays are unit directions.
class FieldTraversal {
 public:
  /// @pre the scene is blended, and requireFields()
  /// @throws levelset::ResourceLimit for fields that take more than maxBytes, or are too wide
  FieldTraversal(const Scene& scene, std::size_t maxBytes);
  /// Takes where the solids are anew. @return has any moved?
  bool updateTransforms(const Scene& scene);

  [[nodiscard]] std::size_t bytes() const;
  [[nodiscard]] std::size_t blockCount() const;
  /// First hit in [near, far]. A ray that is inside at `near` hits where it leaves.
  [[nodiscard]] Hit intersect(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                              double far) const;
  [[nodiscard]] bool isOccluded(const Imath::V3d& origin, const Imath::V3d& direction,
                                double maxDistance) const;
  /// How far the ray is inside in [near, far], world units.
  [[nodiscard]] double thickness(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                                 double far) const;

 private:
  FieldExpression expression_;
  std::vector<FieldGrid> grids_;  // of its operands
  Imath::Box3d box_;              // beyond it the expression is positive
};

}  // namespace render
