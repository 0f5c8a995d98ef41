#pragma once

#include <Imath/ImathBox.h>

#include <cstddef>
#include <vector>

#include "render/bricks/field_grid.h"
#include "render/hit.h"
#include "render/scene/field_expression.h"
#include "render/scene/scene.h"

namespace render {

/// A ray in world space. The direction has unit length.
struct FieldRay {
  Imath::V3d origin, direction;
  double near, far;  ///< searched part, distances along the ray, world units
};

/// A ray from a start, clipped to the box of all fields. The direction has unit length.
struct FieldSegment {
  Imath::V3d start, direction;
  double end;  ///< length of the searched part, world units
};

/// Result of a search along a FieldSegment.
enum class FieldQuestion {
  FirstCrossing,  ///< distance of the first crossing from the start, world units; infinite if none
  InsideLength    ///< length where the expression is negative, world units
};

class FieldTraversal;

/// Interface of the searches along rays, on the processor and on the GPU. All of them return the
/// same bits.
class FieldTracer {
 public:
  virtual ~FieldTracer() = default;
  /// Answers the question for each segment. The default does so on the calling thread.
  [[nodiscard]] virtual std::vector<double> search(const FieldTraversal& fields,
                                                   const std::vector<FieldSegment>& segments,
                                                   FieldQuestion question) const;
};

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
  [[nodiscard]] const FieldExpression& expression() const { return expression_; }
  /// One grid for each operand of the expression.
  [[nodiscard]] const std::vector<FieldGrid>& grids() const { return grids_; }
  /// Bound on the rounding noise of the expression's value, world units.
  [[nodiscard]] double noise() const;
  /// First hits of rays. The solid is where the expression is negative. A ray that is inside the
  /// solid at `near` hits where it leaves the solid.
  [[nodiscard]] std::vector<Hit> intersect(const FieldTracer& tracer,
                                           const std::vector<FieldRay>& rays) const;
  /// Marks the rays that cross the surface: 1, else 0.
  [[nodiscard]] std::vector<char> areOccluded(const FieldTracer& tracer,
                                              const std::vector<FieldRay>& rays) const;
  /// Length of each ray where the expression is negative (inside), world units.
  [[nodiscard]] std::vector<double> thickness(const FieldTracer& tracer,
                                              const std::vector<FieldRay>& rays) const;
  /// Searches one segment on the processor.
  [[nodiscard]] double search(const FieldSegment& segment, FieldQuestion question) const;

 private:
  /// The rays that meet the box of the fields.
  struct Clipped {
    std::vector<FieldSegment> segments;
    std::vector<std::size_t> number;  // index of each segment's ray
    std::vector<double> low;          // distance of each segment's start from its ray's origin
  };
  [[nodiscard]] Clipped clipped(const std::vector<FieldRay>& rays) const;

  FieldExpression expression_;
  std::vector<FieldGrid> grids_;  // one for each operand of expression_
  Imath::Box3d box_;  // box of all fields, world space; outside it the expression is positive
};

}  // namespace render
