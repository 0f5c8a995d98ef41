#pragma once

#include <Imath/ImathVec.h>

#include "mapping/patch.h"

namespace mapping {

/// Texture → patch space straight through the particles: bilinear in u and v within the two levels
/// about w, then linear between them [Brodersen07 §8.4]. Beyond the unit cube the outermost cells
/// go on linearly.
[[nodiscard]] Imath::V3d levelPosition(const Patch& patch, const Imath::V3d& uvw);

/// The longest edge of any cell of particles, across levels included.
[[nodiscard]] double longestCellEdge(const Patch& patch);

}  // namespace mapping
