#pragma once

// For the .cpp files of levelset/flow only.

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <functional>

#include "levelset/progress.h"

namespace levelset::flow {

/// Voxels per unit of time, at a place in voxels and a time. Safe to call from many threads.
using Velocity = std::function<Imath::V3d(const Imath::V3d& place, double time)>;

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
/// The first step is this share of the way: what is still at the start, and at the end of it, may
/// move in between. Not a round number, so as not to fall in step with what comes and goes.
inline constexpr double kFirstShare = 0.0259;

/// Where a step ended, and how long the next one may be.
struct StepMade {
  double time, next;
};

/// Walks from journey.from to journey.to, reporting progress.
/// @param step  makes a step from a time towards journey.to, no longer than it is told (positive)
/// @return      the number of steps
/// @throws ResourceLimit when it sees more steps coming than anybody waits for
std::size_t walk(const TimeInterval& journey,
                 const std::function<StepMade(double from, double longest)>& step);

/// Walks in steps that are short enough at their beginning, on the way and at their end.
/// @param longest  longest step at a time, positive or infinite
/// @param step     makes the step between two times
std::size_t walk(const TimeInterval& journey, const std::function<double(double)>& longest,
                 const std::function<void(double, double)>& step);

/// @throws InvalidInput, telling place and time, unless the velocity is finite
void requireFinite(const TimeInterval& journey, const Imath::V3d& velocity, const Imath::V3d& place,
                   double time);

}  // namespace levelset::flow
