#pragma once

#include <optional>

#include "levelset/fields/field.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct OffsetOptions {
  std::optional<double> halfWidth =
      {};  ///< half width of the result, voxels; empty: that of the operand
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
  const char* action = "offset";  ///< name in messages
};

/// Offsets the surface along its normal by `distance`; a positive distance grows the solid. Extends
/// the distances to the new zero set and re-distances once, for any `distance`.
/// @param distance  world units, any sign
/// @throws UsageError if `distance` is not finite
/// @throws InvalidInput if `solid` or the result is empty
/// @throws ResourceLimit if the memory estimate exceeds the limit, before any allocation
/// @throws Cancelled
[[nodiscard]] NarrowBand offset(NarrowBand solid, double distance,
                                const OffsetOptions& options = {});

/// Offsets each point of the surface along its normal by the local value of `distance`. Implements
/// displacement maps and masked offsets. The new surface is the zero set of
/// φ(x) − distance(closest point of x), re-distanced once. Parts with zero distance stay. Overhangs
/// cannot occur: where the distance varies too fast along the surface, the farthest point along
/// each normal counts.
/// @param distance  world units, any sign
/// @throws as offset()
/// @throws InvalidInput if `distance` is not finite at a point; names the point
[[nodiscard]] NarrowBand offsetBy(NarrowBand solid, const ScalarField& distance,
                                  const OffsetOptions& options = {});

}  // namespace levelset
