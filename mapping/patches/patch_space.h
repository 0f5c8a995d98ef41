#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <optional>
#include <span>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace mapping {

struct PatchSpaceOptions {
  /// Result of sweepSharedSpace. It is used if it extends to the height and is as accurate there as
  /// distances computed for the patch alone.
  const levelset::NarrowBand* shared = nullptr;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

/// Computes distances to the base up to `height` above a patch, by fast sweeping from the narrow
/// band in a box around the patch [Brodersen07 §8.2]. If the height is many voxels, the grid is up
/// to four times coarser. This is accurate enough, because iso-surfaces of φ become smoother with
/// height, and the layer at w = 0 is built from the base's own band.
/// @throws InvalidInput for an open surface whose band does not extend to the height, because such
///         a band cannot be extended
/// @param border  points on the surface along the sides of the patch
/// @param bulge   distance by which the surface between the sides may leave the bounding box of
///         `border`, world units
[[nodiscard]] levelset::NarrowBand sweepPatchSpace(const levelset::NarrowBand& base,
                                                   std::span<const Imath::V3d> border, double bulge,
                                                   double height,
                                                   const PatchSpaceOptions& options = {});

/// Size of a group of patches on one base.
struct PatchCrowd {
  std::size_t count;
  double uSize, vSize;     ///< lengths of the largest patch along u and v, world units
  double lowest, highest;  ///< range of the patch heights, world units, positive
};

/// Computes distances for many patches at once around the entire base, if that costs less than a
/// box around each patch. Returns nothing if it costs more, or needs more than a quarter of the
/// memory limit. Also returns nothing for fewer than two patches, an empty base or an open surface,
/// and where the band of the base extends to the height.
[[nodiscard]] std::optional<levelset::NarrowBand> sweepSharedSpace(
    const levelset::NarrowBand& base, const PatchCrowd& crowd,
    const PatchSpaceOptions& options = {});

}  // namespace mapping
