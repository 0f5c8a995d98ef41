#include "levelset/hamilton_jacobi/time_steps.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/error.h"

namespace levelset::flow {

std::size_t integrate(const Duration& duration,
                      const std::function<StepResult(double, double)>& step) {
  const double to = duration.to, total = std::abs(to - duration.from);
  double time = duration.from, dt = kFirstShare * total;
  std::size_t done = 0;
  while (time != to) {
    report(duration.progress, (time - duration.from) / (to - duration.from));
    const double left = std::abs(to - time);
    // When the time is large, adding a very short step may not change it. A step of four units in
    // the last place does.
    dt = std::max(dt, 4 * std::abs(std::nextafter(time, to) - time));
    // The last two steps each take half of the remaining time.
    const double longest = dt >= left ? left : left < 2 * dt ? left / 2 : dt;
    const StepResult made = step(time, longest);
    const double needed = static_cast<double>(done) + std::abs(to - made.time) / made.next;
    if (!(needed <= kMostSteps) || made.time == time) {
      throw ResourceLimit(
          fmt::format("at time {0:.6g} the {1} limits steps to {2:.3g}, which requires about "
                      "{3:.3g} steps, more "
                      "than the limit of {4}; use a shorter time or a smoother {1}",
                      time, duration.cause, made.next, needed, kMostSteps));
    }
    time = made.time;
    dt = made.next;
    ++done;
  }
  report(duration.progress, 1);
  return done;
}

std::size_t integrate(const Duration& duration, const std::function<double(double)>& longest,
                      const std::function<void(double, double)>& step) {
  const double to = duration.to, sign = to < duration.from ? -1 : 1;
  // Sample times as fractions of a step. Their spacing is uneven, so that they do not match the
  // period of an oscillating velocity.
  constexpr double kSamples[] = {0.146, 0.382, 0.618, 1};
  constexpr double kGrowth = 1.5;
  constexpr int kTries = 40;
  const double total = std::abs(to - duration.from);
  double last = total;
  return integrate(duration, [&](double from, double) {
    const double left = std::abs(to - from);
    const double atStart = longest(from);
    double dt = std::min({left, kGrowth * last, atStart}), least = atStart;
    for (int i = 0; i < kTries; ++i) {
      double allowed = std::numeric_limits<double>::infinity();
      for (const double sample : kSamples)
        allowed = std::min(allowed, longest(from + sign * sample * dt));
      least = std::min(atStart, allowed);
      // While the velocity is zero, steps stay short, so that they do not skip the start of a
      // motion.
      if (std::isinf(least) && dt > kFirstShare * total) {
        dt = kFirstShare * total;
        continue;
      }
      if (dt <= 1.05 * allowed) break;
      dt = std::max(allowed, dt / 4);
    }
    if (dt < left && left < 2 * dt) dt = left / 2;
    const bool isStill = std::isinf(least);
    last = dt;
    const double next = dt >= left ? to : from + sign * dt;
    if (!(left / dt <= kMostSteps)) return StepResult{from, dt};
    if (!isStill) step(from, next);
    return StepResult{next, kGrowth * dt};
  });
}

}  // namespace levelset::flow
