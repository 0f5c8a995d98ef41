#pragma once

// Private to render/embree.

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>
#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "render/bezier/bezier_judge.h"
#include "render/embree/quadrics/quadric_judge.h"
#include "render/embree/terrain/terrain_judge.h"
#include "render/hit.h"
#include "render/scene/scene.h"
#include "render/segmented/interface_judge.h"

namespace render {

/// Parts of a scene with judges of their own: a segmented field, Bézier volumes, quadrics and
/// terrains.
/// Methods may run concurrently.
class JudgedParts {
 public:
  explicit JudgedParts(const Scene& scene);

  [[nodiscard]] bool isEmpty() const {
    return !interfaces_ && beziers_.empty() && quadrics_.empty() && terrains_.empty();
  }
  [[nodiscard]] const Imath::Box3d& bounds() const { return bounds_; }  ///< world space

  /// Number of Bézier volumes that are operands of the expression of the scene. They are no parts
  /// of the hits below.
  [[nodiscard]] std::size_t operandCount() const { return operands_.size(); }
  /// Index of an operand in Scene::beziers.
  [[nodiscard]] std::size_t operand(std::size_t number) const { return operands_[number]; }
  /// A point where a ray enters or leaves an operand.
  struct Crossing {
    Hit hit;
    bool enters;
  };
  /// Crossings of a ray with an operand, from `ray.near` to infinity, in order of their distance.
  [[nodiscard]] std::vector<Crossing> operandCrossings(std::size_t number,
                                                       const Camera::Ray& ray) const;

  /// First hit of a ray with any part.
  /// @param onlyOpaque  true: without transparent Bézier volumes
  /// @pre the direction is finite and not zero
  [[nodiscard]] Hit firstHit(const Camera::Ray& ray, bool onlyOpaque = false) const;
  /// Hits of a ray with all transparent Bézier volumes, in order of their distance.
  [[nodiscard]] std::vector<Hit> transparentHits(const Camera::Ray& ray) const;

 private:
  /// Hits of a ray with a Bézier volume, in order of their distance. @param n  its index
  [[nodiscard]] std::vector<Hit> bezierHits(std::size_t n, const Camera::Ray& ray) const;
  [[nodiscard]] bool isOperand(std::size_t n) const {
    return std::find(operands_.begin(), operands_.end(), n) != operands_.end();
  }

  Imath::Box3d bounds_;
  std::optional<SegmentedPart> segmented_;
  std::optional<InterfaceJudge> interfaces_;  // set for a scene with a segmented field
  std::vector<BezierPart> beziers_;
  std::vector<std::size_t> operands_;  // indices in beziers_ of those that the expression names
  std::vector<QuadricPart> quadrics_;
  std::vector<QuadricJudge> quadricJudges_;
  std::vector<TerrainPart> terrains_;
  std::vector<TerrainJudge> terrainJudges_;
  mutable tbb::enumerable_thread_specific<std::vector<BezierJudge>> bezierJudges_;
  std::size_t firstSolid_ = 0;    // Hit::solid of the segmented field, or of the first part
  std::size_t firstBezier_ = 0;   // Hit::solid of the first Bézier volume
  std::size_t firstQuadric_ = 0;  // Hit::solid of the first part with quadrics
  std::size_t firstTerrain_ = 0;  // Hit::solid of the first terrain
};

}  // namespace render
