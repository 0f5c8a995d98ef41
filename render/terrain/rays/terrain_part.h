#pragma once

#include <Imath/ImathColor.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "render/hit.h"
#include "render/terrain/rays/terrain_caster.h"

namespace render {

/// Colour of the ground at a height of its field, linear.
struct HeightColour {
  double height = 0;
  Imath::C3f colour{0};
};

/// The ground of a terrain in a scene. It is opaque, lit, casts shadows and hides other parts by
/// depth, but cannot be used in the CSG expression of the scene.
struct TerrainPart {
  TerrainCaster caster;
  Imath::C3f colour{0.66f, 0.62f, 0.56f};
  std::uint32_t id = 1;
  std::string name = {};
  /// Replaces `colour` unless it is empty: linear between increasing heights, and constant beyond
  /// them.
  std::vector<HeightColour> ramp = {};

  /// Colour at a height of the field, linear.
  [[nodiscard]] Imath::C3f colourAt(double height) const;
  /// Hit for shading. @param solid  Hit::solid
  [[nodiscard]] Hit hitOf(const Camera::Ray& ray, const TerrainHit& hit, std::size_t solid) const;
};

/// @throws levelset::InvalidInput for a colour outside [0, 1]
void requireColour(const Imath::C3f& colour);

/// Checks a list of colours.
/// @throws levelset::InvalidInput for colours outside [0, 1], and for heights that do not increase
///         or are not finite
void requireRamp(const std::vector<HeightColour>& ramp);

}  // namespace render
