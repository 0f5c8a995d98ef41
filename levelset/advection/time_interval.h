#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <functional>

#include "levelset/hamilton_jacobi/time_steps.h"
#include "levelset/progress.h"

namespace levelset::flow {

/// Velocity in voxels per unit of time, at a position in voxels and a time. Safe to call from many
/// threads.
using Velocity = std::function<Imath::V3d(const Imath::V3d& position, double time)>;

/// Velocity field and the time interval over which it moves the surface.
struct TimeInterval {
  const Velocity& velocity;
  double from, to;
  Imath::M44d toWorld;  ///< transform from index to world space, for error messages
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};

  [[nodiscard]] Duration duration() const { return {.from = from, .to = to, .progress = progress}; }
};

/// Checks that a velocity is finite.
/// @throws InvalidInput with the position in world units and the time, if it is not finite
void requireFinite(const TimeInterval& interval, const Imath::V3d& velocity,
                   const Imath::V3d& position, double time);

}  // namespace levelset::flow
