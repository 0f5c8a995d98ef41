#pragma once

#include <vector>

#include "apps/regress/truth/truth.h"
#include "levelset/narrow_band.h"

namespace regress {

inline constexpr int kRayCount = 10000, kQuickRayCount = 2500;

struct RayHits {
  std::vector<double> errors;  ///< exact distances of all zeros, in the order of rays
  double exactHits = 0;        ///< zeros of the exact distance along the same rays
  double different = 0;        ///< missing and surplus zeros, summed over the rays
};

/// Finds the zeros of the tricubic interpolant of `band` along fixed rays. The rays are chords
/// between Halton points on a ball about the exact solid. They spread evenly over all lines, and so
/// do the first `count` of them.
[[nodiscard]] RayHits shootRays(const levelset::NarrowBand& band, const Truth& truth,
                                int count = kRayCount);

}  // namespace regress
