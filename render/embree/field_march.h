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
/// step is the value over a bound on the slope that is proven for every cell of every grid, so that
/// none passes a crossing; the least step is 1e-7 of the finest voxel, and grows to 1e-2 of it on
/// the way along a surface that is nearer than that. Thread-safe. Rays are unit directions.
class FieldMarch {
 public:
  /// @pre the scene is blended, and requireFields()
  explicit FieldMarch(const Scene& scene);

  /// First hit in [near, far]. A ray that is inside at `near` hits where it leaves.
  [[nodiscard]] Hit intersect(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                              double far) const;
  [[nodiscard]] bool isOccluded(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                                double far) const;
  /// How far the ray is inside in [near, far], world units.
  [[nodiscard]] double thickness(const Imath::V3d& origin, const Imath::V3d& direction, double near,
                                 double far) const;

 private:
  struct MarchedField {
    levelset::NarrowBand band;
    Imath::M44d indexToWorld, worldToIndex;
    Imath::Box3d box;  // of the cells that are not constant, index space
  };
  class RaySegment;

  FieldExpression expression_;
  std::vector<MarchedField> fields_;  // of its operands
  double steepest_ = 1;               // bound on the slopes of all of them
  double leastStep_ = 0;              // world units
};

}  // namespace render
