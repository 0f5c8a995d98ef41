#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "render/bezier/bezier_volume.h"
#include "render/camera.h"

namespace render {

/// Intersection that the judge found.
struct JudgedRoot {
  double distance = 0;                     ///< along the ray, world units
  std::uint32_t patch = 0, attribute = 0;  ///< indices in the volume
  Imath::V3d parameter{0};
  Imath::V3d normal{0};  ///< unit normal to the outside; 0 where it has no direction
  /// True for a box at the deepest level of the search, in which a root is neither proven nor
  /// excluded.
  bool isUndecided = false;
};

/// Independent ray casting of Bézier volumes, to check SharedTree: interval arithmetic along one
/// ray in double precision. A ray is two planes in world space. Boxes of parameters are bounded by
/// Taylor forms about their centres. The operator of Krawczyk proves that a box has no root or one
/// root [Krawczyk69]. It shares the expressions of attributes with the tree, and no geometry: no
/// projection, no de Casteljau, no test of diagonal dominance. Trimming loops are judged by winding
/// angles (judgedContains).
///
/// Taylor forms of large boxes are kept between rays, so an object is for one thread.
class BezierJudge {
 public:
  /// Refers to the volume. @pre requireBezierVolume() accepts the volume
  explicit BezierJudge(const BezierVolume& volume);
  ~BezierJudge();
  BezierJudge(BezierJudge&&) noexcept;
  BezierJudge& operator=(BezierJudge&&) noexcept;

  /// All roots of a ray between its ends, in order of their distance. Roots on common faces of
  /// patches are listed for each patch.
  [[nodiscard]] std::vector<JudgedRoot> roots(const Camera::Ray& ray);

 private:
  class Search;
  std::unique_ptr<Search> search_;
};

}  // namespace render
