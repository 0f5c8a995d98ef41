#pragma once

#include <cstddef>
#include <vector>

#include "mapping/patches/patch.h"

/// Resamples the particle layers of a patch.
namespace mapping {

/// Resamples a layer on the smooth surface (Catmull-Rom) through its particles and rim. The new rim
/// lies one new spacing outside. Where that is beyond the given rim, the surface continues
/// linearly. Returns the given layer if the counts are equal.
/// @param columns, rows  each at least 2
[[nodiscard]] ParticleLayer withCounts(const ParticleLayer& layer, std::size_t columns,
                                       std::size_t rows);

/// A particle below or above the layers of a patch, in the space of an embedded texture: world
/// position and texture coordinates.
struct EmbeddedParticle {
  Imath::V3d position, uvw;
};

/// Particles below the layers, down to w = −embedDepth and somewhat deeper. If embedDepth is
/// negative: above the layers, up to w = 1 − embedDepth and somewhat higher. They continue the
/// columns of the patch linearly. The new layers are at most 1.1 layer spacings apart, or more if
/// there would be over twice as many as the patch has. Particles are left out where columns
/// converge, as below a crease.
/// @param embedDepth  depth of the texture below the surface, as a share of the patch's height; 0
///         gives no particles
[[nodiscard]] std::vector<EmbeddedParticle> embeddedParticles(const Patch& patch,
                                                              double embedDepth);

}  // namespace mapping
