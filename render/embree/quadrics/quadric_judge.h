#pragma once

#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <memory>

#include "render/camera.h"
#include "render/quadrics/quadric.h"

namespace render {

struct JudgedQuadric {
  bool found = false;
  double distance = 0;   ///< along the ray, world units
  Imath::V3d normal{0};  ///< outward unit normal
  Imath::C3f colour{0};
};

/// The judge of quadrics: Embree finds the primitives whose boxes a ray meets, and each is solved
/// in extended precision by its symmetric matrix in world space. It shares no code with the kernel.
/// Methods may run concurrently.
class QuadricJudge {
 public:
  /// @throws levelset::ResourceLimit when Embree cannot allocate memory
  explicit QuadricJudge(QuadricModel model);
  ~QuadricJudge();
  QuadricJudge(QuadricJudge&&) noexcept;
  QuadricJudge& operator=(QuadricJudge&&) noexcept;

  /// First intersection of a ray between its ends.
  [[nodiscard]] JudgedQuadric firstHit(const Camera::Ray& ray) const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace render
