#pragma once

// Private to render/embree.

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>
#include <tbb/enumerable_thread_specific.h>

#include <cstddef>
#include <optional>
#include <vector>

#include "render/bezier/bezier_judge.h"
#include "render/embree/quadrics/quadric_judge.h"
#include "render/hit.h"
#include "render/scene/scene.h"
#include "render/segmented/interface_judge.h"

namespace render {

/// Parts of a scene with judges of their own: a segmented field, Bézier volumes and quadrics.
/// Methods may run concurrently.
class JudgedParts {
 public:
  explicit JudgedParts(const Scene& scene);

  [[nodiscard]] bool isEmpty() const {
    return !interfaces_ && beziers_.empty() && quadrics_.empty();
  }
  [[nodiscard]] const Imath::Box3d& bounds() const { return bounds_; }  ///< world space

  /// First hit of a ray with any part.
  /// @param onlyOpaque  true: without transparent Bézier volumes
  /// @pre the direction is finite and not zero
  [[nodiscard]] Hit firstHit(const Camera::Ray& ray, bool onlyOpaque = false) const;
  /// Hits of a ray with all transparent Bézier volumes, in order of their distance.
  [[nodiscard]] std::vector<Hit> transparentHits(const Camera::Ray& ray) const;

 private:
  /// Hits of a ray with a Bézier volume, in order of their distance. @param n  its index
  [[nodiscard]] std::vector<Hit> bezierHits(std::size_t n, const Camera::Ray& ray) const;

  Imath::Box3d bounds_;
  std::optional<SegmentedPart> segmented_;
  std::optional<InterfaceJudge> interfaces_;  // set for a scene with a segmented field
  std::vector<BezierPart> beziers_;
  std::vector<QuadricPart> quadrics_;
  std::vector<QuadricJudge> quadricJudges_;
  mutable tbb::enumerable_thread_specific<std::vector<BezierJudge>> bezierJudges_;
  std::size_t firstSolid_ = 0;    // Hit::solid of the segmented field, or of the first part
  std::size_t firstBezier_ = 0;   // Hit::solid of the first Bézier volume
  std::size_t firstQuadric_ = 0;  // Hit::solid of the first part with quadrics
};

}  // namespace render
