#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>

#include <optional>
#include <vector>

#include "render/hit.h"
#include "render/scene/field_expression.h"
#include "render/scene/scene.h"

namespace render {

/// The judge of blended scenes: sphere tracing of a FieldExpression in double precision [Hart96]. A
/// step along the ray is |expression| divided by a bound on its slope. The bound holds in every
/// cell of every grid, so no such step passes a crossing. Shorter steps are lengthened to a
/// smallest step of 1e-7 times the finest voxel size. While a ray stays so close to the surface
/// that it takes only smallest steps, their length doubles up to 1e-2 voxel sizes. Thread-safe. Ray
/// directions have unit length.
class FieldMarch {
 public:
  /// @pre the scene is blended and passes requireFields()
  explicit FieldMarch(const Scene& scene);

  /// First hit in [near, far], distances along the ray in world units. The solid is where the
  /// expression is negative. A ray that is inside the solid at `near` hits where it leaves the
  /// solid.
  [[nodiscard]] Hit intersect(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                              double far) const;
  [[nodiscard]] bool isOccluded(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                                double far) const;
  /// Length of the ray within [near, far] where the expression is negative (inside), world units.
  [[nodiscard]] double thickness(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                                 double far) const;

 private:
  struct MarchedField {
    levelset::NarrowBand band;
    Imath::M44d indexToWorld, worldToIndex;
    Imath::Box3d box;  // box of the cells whose values are not constant, index space
  };
  class RaySegment;

  FieldExpression expression_;
  std::vector<MarchedField> fields_;  // one for each operand of expression_
  double steepest_ = 1;   // bound on the slopes of all fields, change of φ per world unit
  double leastStep_ = 0;  // smallest step, world units
};

}  // namespace render
