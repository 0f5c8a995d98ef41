#pragma once

#include <vector>

#include "apps/regress/truth/truth.h"
#include "levelset/narrow_band.h"

namespace regress {

inline constexpr int kRayCount = 10000, kQuickRayCount = 2500;

struct RayHits {
  std::vector<double>
      errors;  ///< exact distances at the zeros of the interpolant, ray by ray, world units
  double exactHits = 0;  ///< number of zeros of the exact distance along the same rays
  double different = 0;  ///< number of missing and surplus zeros, summed over the rays
};

/// Finds the zeros of the tricubic interpolant of `band` along fixed rays. The rays are chords
/// between Halton points on a ball about the exact solid. All chords, and also the first `count` of
/// them, are evenly distributed over the lines that cross the ball.
[[nodiscard]] RayHits shootRays(const levelset::NarrowBand& band, const Truth& truth,
                                int count = kRayCount);

}  // namespace regress
