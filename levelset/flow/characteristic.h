#pragma once

// For the .cpp files of levelset/flow only.

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
  /// How far the second look stands off the line through the first and the third, voxels: it says
  /// nothing of the move.
  double second = 0;
  /// Where the first velocity that is not finite lies: how far from the start, voxels.
  double hole = HUGE_VAL;

  Characteristic(const Velocity& velocity, const Imath::V3d& from, double time, double to);
  /// Was every velocity on the way?
  [[nodiscard]] bool isFinite() const { return std::isfinite(fastest); }
};

/// @throws InvalidInput, telling place and time, unless every velocity that the step looks at is
///         finite
void requireFiniteWay(const TimeInterval& journey, const Imath::V3d& from, double time, double to);

}  // namespace levelset::flow
