#pragma once

#include <span>

#include "mapping/patches/patch.h"

namespace mapping {

/// Makes the particles that adjacent patches share on their sides equal again, after each patch was
/// moved separately. Particles count as shared if they were within a thousandth of the particle
/// spacing before, as those of neighbouring tiles are. Each shared particle gets the mean position.
/// @param before, after  the same patches, with the same layers
void joinSharedParticles(std::span<const Patch> before, std::span<Patch> after);

}  // namespace mapping
