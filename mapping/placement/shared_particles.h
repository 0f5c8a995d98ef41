#pragma once

#include <span>

#include "mapping/patches/patch.h"

namespace mapping {

/// Makes the particles that adjacent patches share on their sides equal again, after each patch was
/// moved separately. Particles of one layer count as shared if in `before` they were within a
/// thousandth of the particle spacing of each other. Neighbouring tiles have such particles. Each
/// shared particle gets the mean position.
/// @param before, after  the same patches, with the same layers
void joinSharedParticles(std::span<const Patch> before, std::span<Patch> after);

}  // namespace mapping
