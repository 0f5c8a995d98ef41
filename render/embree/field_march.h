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
/// step is the value divided by a bound on the slope. The bound is proven for every cell of every
/// grid, so no step passes a crossing. The smallest step is 1e-7 of the finest voxel. It grows to
/// 1e-2 of that voxel where the ray runs along a surface that is nearer than that. Thread-safe. Ray
/// directions have unit length.
class FieldMarch {
 public:
  /// @pre the scene is blended and passes requireFields()
  explicit FieldMarch(const Scene& scene);

  /// First hit in [near, far]. A ray that is inside at `near` hits where it leaves.
  [[nodiscard]] Hit intersect(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                              double far) const;
  [[nodiscard]] bool isOccluded(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                                double far) const;
  /// Length of the ray inside the solid within [near, far], world units.
  [[nodiscard]] double thickness(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                                 double far) const;

 private:
  struct MarchedField {
    levelset::NarrowBand band;
    Imath::M44d indexToWorld, worldToIndex;
    Imath::Box3d box;  // cells whose values are not constant, index space
  };
  class RaySegment;

  FieldExpression expression_;
  std::vector<MarchedField> fields_;  // one for each operand
  double steepest_ = 1;               // bound on the slopes of all fields
  double leastStep_ = 0;              // world units
};

}  // namespace render
