#pragma once

#include <Imath/ImathMatrix.h>

#include <cstddef>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "mapping/maps/patch_map.h"
#include "mapping/patches/patch.h"
#include "mapping/textures/texture_placement.h"

namespace mapping {

struct WarpOptions {
  Imath::M44d indexToWorld;  ///< of the result: rotation, uniform scale, translation
  double scale = 1;          ///< typical stretch: texture distances are multiplied by it
  double mapTolerance =
      0.05;  ///< how far the fast evaluation of the map may be off, texture voxels
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

struct Warp {
  levelset::NarrowBand field;  ///< right zero set and signs; distances are only roughly those
  std::size_t blocksTested = 0, blocksEvaluated = 0;
  std::size_t operations = 0;  ///< particles added up or tetrahedra tried, see BlockMap::evaluate
  std::size_t ghosts =
      0;  ///< grid points that the map, far from the particles, sends back into the texture
  /// Grid points that would have been solids of their own, within a tenth of a voxel of nothing,
  /// and were left out.
  std::size_t crumbs = 0;
  /// Grid points drawn at random where the map was evaluated directly too, and how far the fast
  /// evaluation was off at any of them, texture voxels.
  std::size_t checked = 0;
  double mapError = 0;
};

/// Pulls a texture back into patch space. Blocks of 64³ grid points are split down to 8³ while the
/// image of a block, bounded through the map's slopes, may touch the texture's band; only 8³ blocks
/// that may are evaluated, the others are inside or outside as a whole.
/// @throws InvalidInput when no block meets the texture; ResourceLimit before the limit is passed
[[nodiscard]] Warp warpTexture(const levelset::NarrowBand& texture,
                               const TexturePlacement& placement, const Patch& patch,
                               const PatchMap& map, const WarpOptions& options);

}  // namespace mapping
