#pragma once

#include <cstddef>

#include "levelset/narrow_band.h"
#include "mapping/patches/patch.h"

namespace mapping {

struct Relaxation {
  std::size_t iterations = 0;
  double lastMove = 0;       ///< the farthest that a particle moved in the last iteration, voxels
  bool isConverged = false;  ///< lastMove ≤ 1e-3
};

/// Lets a layer's inner particles come to rest as the masses of a net of springs that stays on
/// φ = layer.height: structural, shear and flexion springs [Provot95], borders fixed, projected
/// after each step. Springs rest at the mean spacing of the borders that they run along.
/// @param isRing  the last column is the first one again, and moves with it
Relaxation relax(const levelset::NarrowBand& band, ParticleLayer& layer, bool isRing = false);

/// Standard deviation / mean of the areas of a layer's cells.
[[nodiscard]] double cellAreaVariation(const ParticleLayer& layer);

}  // namespace mapping
