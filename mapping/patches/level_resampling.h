#pragma once

#include <cstddef>

#include "mapping/patches/patch.h"

/// Other counts of particles on the same smooth surface through a level's.
namespace mapping {

/// A level of other counts on the smooth surface (Catmull-Rom) through the given one and its rim; a
/// rim comes to lie one of the new spacings outside, straight on if that is beyond the given one.
/// The given level for its own counts.
/// @param columns, rows  each at least 2
[[nodiscard]] ParticleLevel withCounts(const ParticleLevel& level, std::size_t columns,
                                       std::size_t rows);

}  // namespace mapping
