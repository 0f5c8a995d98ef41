#pragma once

#include <algorithm>
#include <limits>

/// Limits of accuracy assertions. An assertion states the figure that was measured, and its limit
/// follows from that figure, so that it is at most three times the figure. The script
/// tests/loose_bounds.py lists the assertions whose limit is looser.
namespace support {

/// Limit on an error.
/// @param figure  the largest error measured
/// @param promise  limit that the documentation gives, where it is tighter than the margin
[[nodiscard]] constexpr double measured(double figure,
                                        double promise = std::numeric_limits<double>::infinity()) {
  constexpr double kMargin = 1.5;
  return std::min(kMargin * figure, promise);
}

/// Lower limit on an order of convergence.
/// @param order  the smallest order measured
/// @param promise  limit that the documentation gives, where it is tighter than the margin
[[nodiscard]] constexpr double measuredOrder(double order, double promise = 0) {
  constexpr double kMargin = 0.3;
  return std::max(order - kMargin, promise);
}

/// Limit on an error at the rounding level of float.
/// @param multiple  of the machine epsilon
[[nodiscard]] constexpr double rounding(double multiple) {
  return multiple * static_cast<double>(std::numeric_limits<float>::epsilon());
}

/// Limit on an error at the rounding level of double.
/// @param multiple  of the machine epsilon
[[nodiscard]] constexpr double doubleRounding(double multiple) {
  return multiple * std::numeric_limits<double>::epsilon();
}

}  // namespace support
