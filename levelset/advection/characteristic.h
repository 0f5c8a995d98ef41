#pragma once

// Internal header of levelset: public headers must not include it.

#include <cmath>

#include "levelset/advection/time_interval.h"

namespace levelset::flow {

/// One step along a characteristic with the fifth-order method of Cash and Karp [Cash90]. The error
/// is the difference to its embedded fourth-order method.
struct Characteristic {
  Imath::V3d move{0}, error{0};  ///< voxels
  /// Largest displacement over the step by any sampled velocity, voxels; infinite if one is not
  /// finite.
  double fastest = 0;
  /// Deviation of the second velocity sample from the line through the first and the third, voxels.
  /// The move gives the second sample no weight.
  double stageDeviation = 0;
  /// Distance from the start to the nearest sample that is not finite, voxels.
  double nonFiniteDistance = HUGE_VAL;

  Characteristic(const Velocity& velocity, const Imath::V3d& from, double time, double to);
  /// Returns true when every sampled velocity is finite.
  [[nodiscard]] bool isFinite() const { return std::isfinite(fastest); }
};

/// Checks every velocity that the step samples.
/// @throws InvalidInput with position and time, if one is not finite
void requireFinitePath(const TimeInterval& interval, const Imath::V3d& from, double time,
                       double to);

}  // namespace levelset::flow
