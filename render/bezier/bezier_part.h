#pragma once

#include <Imath/ImathColor.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "render/bezier/bezier_caster.h"
#include "render/hit.h"

namespace render {

/// The surface of a Bézier volume in a scene. It is lit, casts shadows and hides other parts by
/// depth. A closed one may be an operand of the CSG expression of the scene.
struct BezierPart {
  BezierCaster caster;
  Imath::C3f colour{0.66f, 0.62f, 0.56f};
  std::uint32_t id = 1;
  std::string name = {};
  double opacity = 1;  ///< opacity of the surface, for each crossing of a ray, (0, 1]

  /// Hit for shading. @param solid  Hit::solid
  [[nodiscard]] Hit hitOf(const Camera::Ray& ray, double distance, const Imath::V3d& normal,
                          std::size_t solid) const;
};

}  // namespace render
