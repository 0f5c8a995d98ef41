#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/terrain/height_pyramid.h"

namespace levelset::terrain {

/// Rounds up to float, so that a bound stays one.
[[nodiscard]] float heightRoundedUp(double height);

/// Levels and patches of a pyramid, with zeros. @throws as heightPyramid()
[[nodiscard]] HeightPyramid unmeasuredPyramid(int columns, int rows, int cells,
                                              std::size_t maxMemory);

}  // namespace levelset::terrain
