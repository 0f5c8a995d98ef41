#pragma once

#include <array>
#include <span>
#include <vector>

#include "mapping/patches/patch.h"

namespace mapping {

/// For the sides u = 0, u = 1, v = 0 and v = 1 of a patch: true if the side coincides with a side
/// of another patch or of the same one.
using SharedSides = std::array<bool, 4>;

/// Finds the sides, at w = 0, whose end points and middle points lie within a thousandth of the
/// particle spacing of those of another side. Neighbouring tiles have such sides.
[[nodiscard]] std::vector<SharedSides> sharedSides(std::span<const Patch> patches);

}  // namespace mapping
