#include "levelset/advection/time_interval.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/error.h"

namespace levelset::flow {

using Imath::V3d;

void requireFinite(const TimeInterval& interval, const V3d& velocity, const V3d& position,
                   double time) {
  if (std::isfinite(velocity.x) && std::isfinite(velocity.y) && std::isfinite(velocity.z)) return;
  V3d world;
  interval.toWorld.multVecMatrix(position, world);
  throw InvalidInput(
      fmt::format("the velocity is not finite at {:.6g},{:.6g},{:.6g} and time {:.6g}; give a "
                  "velocity that is finite along the path of the surface",
                  world.x, world.y, world.z, time));
}

std::size_t integrate(const TimeInterval& interval,
                      const std::function<StepResult(double, double)>& step) {
  const double to = interval.to, total = std::abs(to - interval.from);
  double time = interval.from, dt = kFirstShare * total;
  std::size_t done = 0;
  while (time != to) {
    report(interval.progress, (time - interval.from) / (to - interval.from));
    const double left = std::abs(to - time);
    // When the time is large, adding a very short step may not change it. A step of four units in
    // the last place does.
    dt = std::max(dt, 4 * std::abs(std::nextafter(time, to) - time));
    // The last two steps each take half of the remaining time.
    const double longest = dt >= left ? left : left < 2 * dt ? left / 2 : dt;
    const StepResult made = step(time, longest);
    const double needed = static_cast<double>(done) + std::abs(to - made.time) / made.next;
    if (!(needed <= kMostSteps) || made.time == time) {
      throw ResourceLimit(fmt::format(
          "at time {:.6g} the velocity limits steps to {:.3g}, which requires "
          "about {:.3g} steps, more than the limit of {}; use a shorter time or a smoother "
          "velocity",
          time, made.next, needed, kMostSteps));
    }
    time = made.time;
    dt = made.next;
    ++done;
  }
  report(interval.progress, 1);
  return done;
}

std::size_t integrate(const TimeInterval& interval, const std::function<double(double)>& longest,
                      const std::function<void(double, double)>& step) {
  const double to = interval.to, sign = to < interval.from ? -1 : 1;
  // Sample times as fractions of a step. Their spacing is uneven, so that they do not match the
  // period of an oscillating velocity.
  constexpr double kSamples[] = {0.146, 0.382, 0.618, 1};
  constexpr double kGrowth = 1.5;
  constexpr int kTries = 40;
  const double total = std::abs(to - interval.from);
  double last = total;
  return integrate(interval, [&](double from, double) {
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
