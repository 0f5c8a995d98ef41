#pragma once

#include <array>
#include <span>
#include <vector>

#include "mapping/patches/patch.h"

namespace mapping {

/// Of a patch: do u = 0, u = 1, v = 0 and v = 1 lie on a side of another patch, or of its own?
using SharedSides = std::array<bool, 4>;

/// Sides on the surface whose ends and middles fall together to a thousandth of the spacing, as
/// those of tiles do.
[[nodiscard]] std::vector<SharedSides> sharedSides(std::span<const Patch> patches);

}  // namespace mapping
