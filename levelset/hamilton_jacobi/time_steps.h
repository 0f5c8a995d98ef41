#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstddef>
#include <functional>

#include "levelset/progress.h"

namespace levelset::flow {

/// Time interval of a motion.
struct Duration {
  double from, to;
  Progress progress = {};
  const char* cause = "velocity";  ///< quantity that limits the steps, for error messages
};

inline constexpr double kMostSteps = 20000;
/// Length of the first step as a fraction of the time interval. A velocity that is zero at both
/// ends of a step may move the surface in between, so the first step is short. The fraction is not
/// a round number, so that the step is no multiple of the period of an oscillating velocity.
inline constexpr double kFirstShare = 0.0259;

/// End time of a step, and the longest allowed next step.
struct StepResult {
  double time, next;
};

/// Integrates the motion over the time interval step by step and reports progress.
/// @param step  takes a step from a time towards duration.to, of at most the given positive length
/// @return the number of steps
/// @throws ResourceLimit when the step lengths predict more than kMostSteps steps
std::size_t integrate(const Duration& duration,
                      const std::function<StepResult(double from, double longest)>& step);

/// Integrates the motion over the time interval. A step is no longer than the limit `longest` at
/// its start, at its end and at three times in between. Skips steps on which nothing moves.
/// @param longest  returns the longest allowed step at a time; infinite where the velocity is zero
/// @param step     moves the surface between two times
std::size_t integrate(const Duration& duration, const std::function<double(double)>& longest,
                      const std::function<void(double, double)>& step);

}  // namespace levelset::flow
