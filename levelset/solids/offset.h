#pragma once

#include <optional>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct OffsetOptions {
  std::optional<double> halfWidth = {};  ///< of the result, voxels; empty: as the operand
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
  const char* action = "offset";  ///< in messages
};

/// Moves the surface along its normal by `distance`; positive grows the solid. Distances are swept
/// out to the new zero set and re-distanced once, whatever `distance`.
/// @param distance  world units, any sign
/// @throws UsageError if `distance` is not finite; InvalidInput if `solid` is empty or nothing is
/// left;
///         ResourceLimit, before anything is allocated; Cancelled
[[nodiscard]] NarrowBand offset(NarrowBand solid, double distance,
                                const OffsetOptions& options = {});

}  // namespace levelset
