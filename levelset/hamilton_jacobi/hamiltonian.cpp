#include "levelset/hamilton_jacobi/hamiltonian.h"

#include <algorithm>
#include <cmath>

namespace levelset::flow {

using Imath::V3d;

double godunovSlope(const OneSidedSlopes& slopes, double speed) {
  if (speed == 0) return 0;
  const double sign = speed > 0 ? 1 : -1;
  double squared = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double steepest = std::max({sign * slopes.lower[axis], -sign * slopes.upper[axis], 0.0});
    squared += steepest * steepest;
  }
  return std::sqrt(squared);
}

NumericalHamiltonian upwindHamiltonian(const OneSidedSlopes& slopes,
                                       const Hamiltonian& hamiltonian) {
  // Step of the differences of H. The slopes are about 1.
  constexpr double kStep = 1e-4;
  // Where the slopes differ by less than this on each axis, φ is smooth, and the directions at the
  // mean slope suffice.
  constexpr double kSmooth = 0.05;
  const V3d mean = (slopes.lower + slopes.upper) / 2;
  V3d least(HUGE_VAL), most(-HUGE_VAL);
  const auto addSpeedsAt = [&](const V3d& at) {
    for (int axis = 0; axis < 3; ++axis) {
      V3d before = at, after = at;
      before[axis] -= kStep;
      after[axis] += kStep;
      const double speed = (hamiltonian(after) - hamiltonian(before)) / (2 * kStep);
      least[axis] = std::min(least[axis], speed);
      most[axis] = std::max(most[axis], speed);
    }
  };
  addSpeedsAt(mean);
  const V3d jump = slopes.upper - slopes.lower;
  if (std::max({std::abs(jump.x), std::abs(jump.y), std::abs(jump.z)}) > kSmooth) {
    addSpeedsAt(slopes.lower);
    addSpeedsAt(slopes.upper);
  }
  NumericalHamiltonian result;
  V3d gradient = mean;
  double dissipation = 0;
  for (int axis = 0; axis < 3; ++axis) {
    result.speeds[axis] = std::max(-least[axis], most[axis]);
    if (least[axis] >= 0)
      gradient[axis] = slopes.lower[axis];
    else if (most[axis] <= 0)
      gradient[axis] = slopes.upper[axis];
    else
      dissipation += result.speeds[axis] * jump[axis] / 2;
  }
  result.value = hamiltonian(gradient) - dissipation;
  return result;
}

}  // namespace levelset::flow
