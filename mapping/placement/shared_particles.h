#pragma once

#include <span>

#include "mapping/patches/patch.h"

namespace mapping {

/// Particles on the sides of a layer of patches that fell together before each patch was moved by
/// itself, to a thousandth of the spacing as those of tiles do, fall together again: in the mean of
/// their places.
/// @param before, after  the same patches, with the same layers
void joinSharedParticles(std::span<const Patch> before, std::span<Patch> after);

}  // namespace mapping
