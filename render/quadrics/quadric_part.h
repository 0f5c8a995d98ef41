#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "render/hit.h"
#include "render/quadrics/quadric_caster.h"

namespace render {

/// Quadrics in a scene. They are opaque, and each has a colour. They are lit, cast shadows and hide
/// other parts by depth, but cannot be used in the CSG expression of the scene.
struct QuadricPart {
  QuadricCaster caster;
  std::uint32_t id = 1;
  std::string name = {};

  /// Hit for shading. @param solid  Hit::solid
  [[nodiscard]] Hit hitOf(const Camera::Ray& ray, double distance, const Imath::V3d& normal,
                          const Imath::C3f& colour, std::size_t solid) const;
};

/// Spheres and cylinders as a part, as of the atoms and bonds of a molecule.
/// @throws as QuadricCaster()
[[nodiscard]] QuadricPart makeQuadricPart(std::vector<Ball> balls, std::vector<Stick> sticks,
                                          const std::string& name = "quadrics",
                                          std::size_t maxBytes = levelset::kNoMemoryLimit);

}  // namespace render
