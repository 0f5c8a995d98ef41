#pragma once

// Private to render/effects: patterns in space.

#include <Imath/ImathVec.h>

#include "render/effects/effects.h"

namespace render {

/// Gradient noise [Perlin02] with C² cubes, from −1 to 1. It is 0 at points with integer
/// coordinates.
[[nodiscard]] double gradientNoise(const Imath::V3d& p);

/// Linear colour of a pattern of size 1 at a point. @pre the texture is not SolidTexture::None
[[nodiscard]] Imath::V3d patternColour(SolidTexture texture, const Imath::V3d& p);

}  // namespace render
