#pragma once

// Internal header of levelset: public headers must not include it.

#include <cmath>

#include "levelset/advection/time_interval.h"

namespace levelset::flow {

/// One Runge-Kutta step along a characteristic (the path of a point in the velocity field) with the
/// fifth-order method of Cash and Karp [Cash90].
struct Characteristic {
  /// Displacement over the step, and its difference to the embedded fourth-order method, voxels.
  Imath::V3d move{0}, error{0};
  /// Largest sampled speed times the length of the step, voxels; infinite if a sampled velocity is
  /// not finite.
  double fastest = 0;
  /// Difference between the second velocity sample and the line through the first and the third,
  /// times the length of the step, voxels. It shows a jump of the velocity at the second sample,
  /// which has no weight in `move` and `error`.
  double stageDeviation = 0;
  /// Distance from the start to the nearest position where a sampled velocity is not finite,
  /// voxels. HUGE_VAL: all are finite.
  double nonFiniteDistance = HUGE_VAL;

  Characteristic(const Velocity& velocity, const Imath::V3d& from, double time, double to);
  /// Returns true when every sampled velocity is finite.
  [[nodiscard]] bool isFinite() const { return std::isfinite(fastest); }
};

/// Checks every velocity that a step from `from`, between two times, samples.
/// @throws InvalidInput with position and time, if one is not finite
void requireFinitePath(const TimeInterval& interval, const Imath::V3d& from, double time,
                       double to);

}  // namespace levelset::flow
