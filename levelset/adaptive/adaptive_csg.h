#pragma once

#include <cstddef>
#include <span>

#include "levelset/adaptive/adaptive_field.h"
#include "levelset/csg/csg.h"
#include "levelset/progress.h"

namespace levelset {

struct AdaptiveCsgOptions {
  double tolerance = 0;  ///< error of the result, world units; 0: the largest one of the operands
  double halfWidth = 0;  ///< half width of the result, world units; 0: the smallest one
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Combines solids from left to right; Difference subtracts all others from the first. The minimum
/// or maximum of the distances gives the surface of the result. It is only a bound of the distance
/// away from it, so the distances are computed again from the mesh of that surface. The tolerance
/// holds beside those of the operands. The result is tricubic if all operands are.
/// @throws UsageError for fewer than two solids, a negative tolerance or half width
/// @throws InvalidInput if a solid or the result is empty
/// @throws ResourceLimit, Cancelled
[[nodiscard]] AdaptiveField combineAdaptive(CsgOperation operation,
                                            std::span<const AdaptiveField> solids,
                                            const AdaptiveCsgOptions& options = {});

/// Offsets a solid outwards (distance > 0) or inwards. The surface is that of the field at this
/// distance; the distances are computed again from its mesh.
/// @param distance  world units; its magnitude is at most the half width of the field less the
///        tolerance, since the values are coarse farther away
/// @throws UsageError for a larger distance; InvalidInput if the field or the result is empty
/// @throws ResourceLimit, Cancelled
[[nodiscard]] AdaptiveField offsetAdaptive(const AdaptiveField& solid, double distance,
                                           const AdaptiveCsgOptions& options = {});

}  // namespace levelset
