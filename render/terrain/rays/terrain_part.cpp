#include "render/terrain/rays/terrain_part.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"

namespace render {

Imath::C3f TerrainPart::colourAt(double height) const {
  if (ramp.empty()) return colour;
  const auto above = std::find_if(ramp.begin(), ramp.end(), [height](const HeightColour& entry) {
    return entry.height > height;
  });
  if (above == ramp.begin()) return above->colour;
  const HeightColour& below = *(above - 1);
  if (above == ramp.end()) return below.colour;
  const auto share = static_cast<float>((height - below.height) / (above->height - below.height));
  return below.colour * (1 - share) + above->colour * share;
}

Hit TerrainPart::hitOf(const Camera::Ray& ray, const TerrainHit& hit, std::size_t solid) const {
  Hit result = exactHit(ray.origin + ray.direction * hit.distance, hit.distance, hit.normal,
                        caster.bounds().size().length(), colourAt(hit.height), id, solid);
  result.facetNormal = hit.facetNormal;
  return result;
}

void requireColour(const Imath::C3f& colour) {
  for (int c = 0; c < 3; ++c)
    if (!(colour[c] >= 0 && colour[c] <= 1))
      throw levelset::InvalidInput(
          fmt::format("the colour {}, {}, {} is out of range; give three numbers from 0 to 1",
                      colour.x, colour.y, colour.z));
}

void requireRamp(const std::vector<HeightColour>& ramp) {
  for (std::size_t n = 0; n < ramp.size(); ++n) {
    const auto& [height, colour] = ramp[n];
    if (!std::isfinite(height) || (n > 0 && !(height > ramp[n - 1].height)))
      throw levelset::InvalidInput(fmt::format(
          "height {} of the colours is {}; give finite heights that increase", n + 1, height));
    requireColour(colour);
  }
}

}  // namespace render
