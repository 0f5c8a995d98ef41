#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <functional>

#include "levelset/progress.h"

namespace levelset::flow {

/// Voxels per unit of time, at a position in voxels and a time. Safe to call from many threads.
using Velocity = std::function<Imath::V3d(const Imath::V3d& position, double time)>;

/// What is carried from when to when.
struct TimeInterval {
  const Velocity& velocity;
  double from, to;
  const char* action;   ///< for messages
  Imath::M44d toWorld;  ///< from voxels, for messages
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

inline constexpr double kMostSteps = 20000;
/// The first step is this share of the path: what is still at the start, and at the end of it, may
/// move in between. Not a round number, so as not to fall in step with what comes and goes.
inline constexpr double kFirstShare = 0.0259;

/// Where a step ended, and how long the next one may be.
struct StepResult {
  double time, next;
};

/// Walks from interval.from to interval.to, reporting progress.
/// @param step  makes a step from a time towards interval.to, no longer than it is told (positive)
/// @return      the number of steps
/// @throws ResourceLimit when it sees more steps coming than anybody waits for
std::size_t integrate(const TimeInterval& interval,
                      const std::function<StepResult(double from, double longest)>& step);

/// Walks in steps that are short enough at their beginning, on the path and at their end.
/// @param longest  longest step at a time, positive or infinite
/// @param step     makes the step between two times
std::size_t integrate(const TimeInterval& interval, const std::function<double(double)>& longest,
                      const std::function<void(double, double)>& step);

/// @throws InvalidInput, telling position and time, unless the velocity is finite
void requireFinite(const TimeInterval& interval, const Imath::V3d& velocity,
                   const Imath::V3d& position, double time);

}  // namespace levelset::flow
