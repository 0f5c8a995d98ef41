#pragma once

#include <optional>

#include "levelset/fields/field.h"
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

/// Moves each point of the surface along its normal by the length that `distance` has there (world
/// units, any sign): a displacement map, or an offset under a mask. The new surface is the zero set
/// of φ(x) − distance(closest point of x), re-distanced once; what it does not reach is as before.
/// Where the length changes faster along the surface than the surface's own curvature lets normals
/// meet, the farthest point along each normal counts: no overhangs.
/// @throws as offset(), InvalidInput where `distance` is not finite, with the place
[[nodiscard]] NarrowBand offsetBy(NarrowBand solid, const ScalarField& distance,
                                  const OffsetOptions& options = {});

}  // namespace levelset
