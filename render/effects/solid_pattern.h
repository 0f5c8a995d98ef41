#pragma once

// Private to render/effects: patterns in space.

#include <Imath/ImathVec.h>

#include "render/effects/effects.h"

namespace render {

/// Linear colour of a pattern of size 1 at a point. @pre the texture is not SolidTexture::None
[[nodiscard]] Imath::V3d patternColour(SolidTexture texture, const Imath::V3d& p);

}  // namespace render
