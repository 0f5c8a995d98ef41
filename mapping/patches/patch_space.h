#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <optional>
#include <span>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace mapping {

struct PatchSpaceOptions {
  /// Of sweepSharedSpace; taken where it reaches the height and is as exact there as the patch's
  /// own.
  const levelset::NarrowBand* shared = nullptr;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

/// Distances to the base as far as `height` above a patch, swept out of the narrow band in a box
/// about it [Brodersen07 §8.2]. Where that is many voxels, a grid of up to a quarter of the
/// resolution does: layers of φ grow smooth with their height, and the surface itself is left to
/// the base's own band.
/// @throws InvalidInput for an open surface whose band does not reach far enough: it cannot be
/// swept
/// @param border  points on the surface along the sides of the patch
/// @param bulge   how far the inner surface may leave the box of the border, world units
[[nodiscard]] levelset::NarrowBand sweepPatchSpace(const levelset::NarrowBand& base,
                                                   std::span<const Imath::V3d> border, double bulge,
                                                   double height,
                                                   const PatchSpaceOptions& options = {});

/// Many patches on one base.
struct PatchCrowd {
  std::size_t count;
  double uSize, vSize;     ///< of the largest, world units
  double lowest, highest;  ///< of their heights, world units, positive
};

/// Distances for many patches at once: around all of the base, when that costs less than a box
/// about each of them. None when it costs more, or more than a quarter of the memory.
[[nodiscard]] std::optional<levelset::NarrowBand> sweepSharedSpace(
    const levelset::NarrowBand& base, const PatchCrowd& crowd,
    const PatchSpaceOptions& options = {});

}  // namespace mapping
