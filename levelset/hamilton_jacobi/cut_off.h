#pragma once

#include <cmath>

namespace levelset::flow {

/// Cut-off c(φ) that fades a speed out towards the end of a narrow band, equation 6.16 of
/// [Brodersen07]. A cubic between 1 and 0, with a slope of zero at both ends.
/// @param distance  φ, any unit
/// @param full      β: |φ| up to which the factor is 1, in the same unit, ≥ 0
/// @param zero      γ: |φ| from which the factor is 0, in the same unit, above `full`
[[nodiscard]] inline double cutOff(double distance, double full, double zero) {
  const double d = std::abs(distance);
  if (d <= full) return 1;
  if (d >= zero) return 0;
  const double width = zero - full, left = (zero - d) / width;
  return left * left * (2 * d + zero - 3 * full) / width;
}

}  // namespace levelset::flow
