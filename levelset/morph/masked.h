#pragma once

#include <functional>
#include <optional>

#include "levelset/fields/mask.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct MaskedOptions {
  std::optional<double> halfWidth = {};  ///< of the result, voxels; empty: as the operand
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Applies a change of a solid where a mask allows it: morphs from the solid to the changed solid,
/// at each point by the weight of the mask. The surface stays where the weight is 0.
/// @param farthest  largest distance by which the change moves the surface, world units
/// @param change    computes the changed solid, and reports its progress
/// @throws UsageError for a bad mask; InvalidInput if a solid is empty or nothing is left;
///         ResourceLimit; Cancelled; what `change` throws
[[nodiscard]] NarrowBand masked(const NarrowBand& solid, const Mask& mask, double farthest,
                                const std::function<NarrowBand(const Progress&)>& change,
                                const MaskedOptions& options = {});

}  // namespace levelset
