#include "render/segmented/segmented_part.h"

#include <array>

namespace render {

using levelset::RegionLabel;

namespace {

// Distance of the trilinear interfaces from the smooth ones, voxels: 0.25 / R for a radius of
// curvature of R voxels, so this holds down to five voxels.
constexpr double kRipple = 0.05;

}  // namespace

Imath::C3f regionColour(RegionLabel label) {
  constexpr std::array<std::array<float, 3>, 7> kColours = {{{0.90f, 0.62f, 0.00f},
                                                             {0.34f, 0.71f, 0.91f},
                                                             {0.00f, 0.62f, 0.45f},
                                                             {0.94f, 0.89f, 0.26f},
                                                             {0.00f, 0.45f, 0.70f},
                                                             {0.84f, 0.37f, 0.00f},
                                                             {0.80f, 0.47f, 0.65f}}};
  const auto& c = kColours[(label + kColours.size() - 1) % kColours.size()];
  return {c[0], c[1], c[2]};
}

Hit SegmentedPart::hitOf(const InterfaceRay& ray, const InterfaceHit& hit,
                         std::size_t solid) const {
  Hit result;
  if (!hit.found) return result;
  const RegionLabel label = seen(hit);
  result.found = true;
  result.distance = hit.distance;
  result.position = ray.origin + ray.direction * hit.distance;
  result.normal = hit.normal;
  result.facetNormal = hit.facetNormal;
  result.surfaceError = kRipple * caster.field().voxelSize();
  result.colour = regionColour(label);
  result.id = label;
  result.solid = solid;
  return result;
}

}  // namespace render
