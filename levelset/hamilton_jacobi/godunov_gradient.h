#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace levelset::flow {

/// One-sided derivatives of φ along the three axes.
struct OneSidedDerivatives {
  std::array<double, 3> behind;  ///< φ⁻: from the grid points with lower coordinates
  std::array<double, 3> ahead;   ///< φ⁺: from the grid points with higher coordinates
};

/// Norm |∇φ| of the term speed · |∇φ| by Godunov's scheme, which takes each derivative from the
/// side that the front comes from [Osher91]; equation 6.13 of [Brodersen07].
/// @param speed  only its sign counts: positive moves the front towards higher φ; 0 gives 0
[[nodiscard]] inline double godunovGradient(const OneSidedDerivatives& d, double speed) {
  if (speed == 0) return 0;
  const double sign = speed > 0 ? 1 : -1;
  double sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double slope = std::max({sign * d.behind[axis], -sign * d.ahead[axis], 0.0});
    sum += slope * slope;
  }
  return std::sqrt(sum);
}

}  // namespace levelset::flow
