#pragma once

#include <Imath/ImathBox.h>

#include <cstddef>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "mapping/patch.h"
#include "mapping/rbf_map.h"

namespace mapping {

/// Where a texture lies in texture space: the unit cube is `box`, pushed inwards by `sink`.
struct TexturePlacement {
  Imath::Box3d box;
  double sink = 0;  ///< in w
  [[nodiscard]] Imath::V3d toTexture(const Imath::V3d& uvw) const {
    return box.min + Imath::V3d(uvw.x, uvw.y, uvw.z + sink) * box.size();
  }
  [[nodiscard]] Imath::V3d toUvw(const Imath::V3d& texture) const {
    return (texture - box.min) / box.size() - Imath::V3d(0, 0, sink);
  }
};

struct WarpOptions {
  Imath::M44d indexToWorld;  ///< of the result: rotation, uniform scale, translation
  double scale = 1;          ///< typical stretch: texture distances are multiplied by it
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

struct Warp {
  levelset::NarrowBand field;  ///< right zero set and signs; distances are only roughly those
  std::size_t blocksTested = 0, blocksEvaluated = 0;
  std::size_t ghosts =
      0;  ///< grid points that the map, far from the particles, sends back into the texture
};

/// Pulls a texture back into patch space. Blocks of 64³ grid points are split down to 8³ while the
/// image of a block, bounded through the map's slopes, may touch the texture's band; only 8³ blocks
/// that may are evaluated, the others are inside or outside as a whole.
/// @throws InvalidInput when no block meets the texture; ResourceLimit before allocating
[[nodiscard]] Warp warpTexture(const levelset::NarrowBand& texture,
                               const TexturePlacement& placement, const Patch& patch,
                               const RbfMap& map, const WarpOptions& options);

}  // namespace mapping
