#pragma once

#include <span>

#include "mapping/patches/patch.h"

namespace mapping {

/// Joins the particles that adjacent patches share on their sides again, after each patch was moved
/// separately. Particles count as shared if they coincided before to a thousandth of the spacing,
/// as those of tiles do. Each joined particle gets the mean position.
/// @param before, after  the same patches, with the same layers
void joinSharedParticles(std::span<const Patch> before, std::span<Patch> after);

}  // namespace mapping
