#pragma once

#include <cstddef>
#include <vector>

#include "mapping/patches/patch.h"

/// Other counts of particles on the same smooth surface through a layer's.
namespace mapping {

/// A layer of other counts on the smooth surface (Catmull-Rom) through the given one and its rim; a
/// rim comes to lie one of the new spacings outside, straight on if that is beyond the given one.
/// The given layer for its own counts.
/// @param columns, rows  each at least 2
[[nodiscard]] ParticleLayer withCounts(const ParticleLayer& layer, std::size_t columns,
                                       std::size_t rows);

/// A particle below the layers of a patch, or above them.
struct EmbeddedParticle {
  Imath::V3d position, uvw;
};

/// Below w = −sink, or above w = 1 − sink where that is more, and in between: the columns of the
/// patch go straight on, in layers no wider apart than the patch's own there. Left out where
/// columns come together, as below a crease.
/// @param sink  as a share of the patch's height
[[nodiscard]] std::vector<EmbeddedParticle> embeddedParticles(const Patch& patch,
                                                              double embedDepth);

}  // namespace mapping
