#pragma once

#include <Imath/ImathColor.h>

#include <cstddef>
#include <string>
#include <vector>

#include "render/hit.h"
#include "render/segmented/interface_caster.h"

namespace render {

/// Colours of regions: those of Okabe and Ito, which people with colour blindness can tell apart.
/// Linear light. The void has a colour for the sheets in it.
[[nodiscard]] Imath::C3f regionColour(levelset::RegionLabel label);

/// A segmented field in a scene. Its surfaces are opaque. An interface has the colour of the region
/// behind it, as the ray goes, or of the region in front if the other is hidden. So the two sides
/// of an interface differ. A sheet has the colour of the region around it.
struct SegmentedPart {
  InterfaceCaster caster;
  std::string name = {};

  /// Region whose colour and id a hit shows.
  [[nodiscard]] levelset::RegionLabel seen(const InterfaceHit& hit) const {
    return caster.isShown(hit.behind) ? hit.behind : hit.front;
  }
  /// Hit for shading. Normals face the ray. @param solid  Hit::solid
  [[nodiscard]] Hit hitOf(const InterfaceRay& ray, const InterfaceHit& hit,
                          std::size_t solid) const;
};

}  // namespace render
