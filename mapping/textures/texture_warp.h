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
  /// Index-to-world transform of the result: rotation, uniform scale and translation.
  Imath::M44d indexToWorld;
  /// Mean stretch of the map from the texture to the patch, by which the texture's distances are
  /// multiplied.
  double scale = 1;
  /// Error bound of the map's fast evaluation, texture voxels.
  double mapTolerance = 0.05;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

struct Warp {
  levelset::NarrowBand field;  ///< zero set and signs are correct; distances are approximate
  std::size_t blocksTested = 0, blocksEvaluated = 0;
  std::size_t operations = 0;  ///< particles summed or tetrahedra tested, see BlockMap::evaluate
  /// Number of grid points far from the particles that the map sends back into the texture; they
  /// are left out.
  std::size_t ghosts = 0;
  /// Number of isolated inside grid points less than a tenth of a voxel deep. They are left out so
  /// that they do not become separate solids.
  std::size_t crumbs = 0;
  /// Number of random grid points where the map was also evaluated directly, and the largest error
  /// of the fast evaluation at these points, texture voxels.
  std::size_t checked = 0;
  double mapError = 0;
};

/// Evaluates a texture through a map on the grid of the result. Blocks of 64³ grid points are split
/// down to 8³ as long as the image of a block may touch the texture's band. BlockMap::imageBounds
/// bounds the image. Only such 8³ blocks are evaluated; the other blocks lie completely inside or
/// outside the warped texture.
/// @throws InvalidInput if no block meets the texture
/// @throws ResourceLimit before memory exceeds `maxMemory`
[[nodiscard]] Warp warpTexture(const levelset::NarrowBand& texture,
                               const TexturePlacement& placement, const Patch& patch,
                               const PatchMap& map, const WarpOptions& options);

}  // namespace mapping
