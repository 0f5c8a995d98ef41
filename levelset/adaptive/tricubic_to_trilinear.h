#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstddef>

#include "levelset/adaptive/adaptive_field.h"
#include "levelset/error.h"
#include "levelset/progress.h"

namespace levelset {

/// Samples a tricubic field near its zero set as a trilinear one, with half of its tolerance where
/// the octree is deep enough for it.
/// @throws ResourceLimit, Cancelled
[[nodiscard]] AdaptiveField trilinearSurface(const AdaptiveField& field, std::size_t maxMemory,
                                             const Progress& progress);

/// Calls make(tolerance / 2), or make(tolerance) if the octree or the precision of the coordinates
/// does not suffice for that.
template <class Make>
[[nodiscard]] AdaptiveField withFinerTolerance(double tolerance, const Make& make) {
  try {
    return make(tolerance / 2);
  } catch (const UsageError&) {
  } catch (const InvalidInput&) {
  }
  return make(tolerance);
}

}  // namespace levelset
