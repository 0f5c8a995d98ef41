#pragma once

#include <cstddef>

#include "levelset/narrow_band.h"
#include "mapping/patches/patch.h"

namespace mapping {

struct Relaxation {
  std::size_t iterations = 0;
  double lastMove = 0;       ///< largest displacement of a particle in the last iteration, voxels
  bool isConverged = false;  ///< true: lastMove is at most 1e-3 voxel
};

/// Relaxes the inner particles of a layer as masses of a spring net. The net has structural, shear
/// and flexion springs [Provot95] and fixed borders. After each step, its particles are projected
/// onto φ = layer.height. The rest length of a spring along a row or column is interpolated between
/// the mean spacings of the two borders parallel to it.
/// @param isRing  the last column equals the first one, and moves with it
Relaxation relax(const levelset::NarrowBand& band, ParticleLayer& layer, bool isRing = false);

/// Ratio of the standard deviation to the mean of the areas of a layer's cells.
[[nodiscard]] double cellAreaVariation(const ParticleLayer& layer);

}  // namespace mapping
