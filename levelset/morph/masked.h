#pragma once

#include <functional>
#include <optional>

#include "levelset/fields/mask.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct MaskedOptions {
  /// Half width of the result, voxels; empty: the half width of the given solid.
  std::optional<double> halfWidth = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Applies a change of a solid where a mask allows it. Morphs from the solid to the changed solid;
/// at each point, the fraction of the morph is the mask's weight there. The surface stays where the
/// weight is 0.
/// @param farthest  largest distance by which the change moves the surface, world units
/// @param change    computes the changed solid, reporting its progress to the argument
/// @throws UsageError for an invalid mask
/// @throws InvalidInput if a solid or the result is empty
/// @throws ResourceLimit
/// @throws Cancelled
/// @throws any exception of `change`
[[nodiscard]] NarrowBand masked(const NarrowBand& solid, const Mask& mask, double farthest,
                                const std::function<NarrowBand(const Progress&)>& change,
                                const MaskedOptions& options = {});

}  // namespace levelset
