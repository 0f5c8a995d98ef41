#pragma once

#include <Imath/ImathVec.h>

namespace levelset {

/// Gradient noise [Perlin02] with C² cubes, from −1 to 1. It is 0 at points with integer
/// coordinates, and at points whose coordinates are not finite.
[[nodiscard]] double gradientNoise(const Imath::V3d& p);

}  // namespace levelset
