#pragma once

// Internal header of levelset: public headers must not include it.

#include <cmath>

#include "levelset/flow/time_interval.h"

namespace levelset::flow {

/// One step along a characteristic: the fifth-order method of Cash and Karp, and how far its
/// fourth-order one ends from it [Cash90].
struct Characteristic {
  Imath::V3d move{0}, error{0};  ///< voxels
  /// The farthest that any velocity that it looks at would move, voxels; infinite if one is not
  /// finite.
  double fastest = 0;
  /// How far the second sample stands off the line through the first and the third, voxels: it says
  /// nothing of the move.
  double stageDeviation = 0;
  /// Where the first velocity that is not finite lies: how far from the start, voxels.
  double nonFiniteDistance = HUGE_VAL;

  Characteristic(const Velocity& velocity, const Imath::V3d& from, double time, double to);
  /// Was every velocity on the path?
  [[nodiscard]] bool isFinite() const { return std::isfinite(fastest); }
};

/// @throws InvalidInput, telling position and time, unless every velocity that the step looks at is
///         finite
void requireFinitePath(const TimeInterval& interval, const Imath::V3d& from, double time,
                       double to);

}  // namespace levelset::flow
