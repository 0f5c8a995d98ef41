#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <functional>

#include "levelset/progress.h"

namespace levelset::flow {

/// Velocity in voxels per unit of time, at a position in voxels and a time. Safe to call from many
/// threads.
using Velocity = std::function<Imath::V3d(const Imath::V3d& position, double time)>;

/// Velocity field and the time interval over which it moves the surface.
struct TimeInterval {
  const Velocity& velocity;
  double from, to;
  Imath::M44d toWorld;  ///< from voxels, for messages
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

inline constexpr double kMostSteps = 20000;
/// First step as a share of the interval. A velocity that is zero at both ends of a step may move
/// the surface in between, so the first step is short. The share is not a round number, so that it
/// does not match the period of an oscillating velocity.
inline constexpr double kFirstShare = 0.0259;

/// End time of a step, and the longest allowed next step.
struct StepResult {
  double time, next;
};

/// Integrates over the interval step by step and reports progress.
/// @param step  takes a step from a time towards interval.to, of at most the given positive length
/// @return the number of steps
/// @throws ResourceLimit when the step lengths predict more than kMostSteps steps
std::size_t integrate(const TimeInterval& interval,
                      const std::function<StepResult(double from, double longest)>& step);

/// Integrates over the interval in steps that the limit allows at their beginning, between and at
/// their end.
/// @param longest  longest step at a time, positive or infinite
/// @param step     takes the step between two times
std::size_t integrate(const TimeInterval& interval, const std::function<double(double)>& longest,
                      const std::function<void(double, double)>& step);

/// Checks that a velocity is finite.
/// @throws InvalidInput with position and time, if it is not finite
void requireFinite(const TimeInterval& interval, const Imath::V3d& velocity,
                   const Imath::V3d& position, double time);

}  // namespace levelset::flow
