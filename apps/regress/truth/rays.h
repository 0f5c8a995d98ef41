#pragma once

#include <vector>

#include "apps/regress/truth/truth.h"
#include "levelset/narrow_band.h"

namespace regress {

inline constexpr int kRayCount = 10000, kQuickRayCount = 2500;

struct RayHits {
  std::vector<double> errors;  ///< exact distances of all zeros, in the order of rays
  double exactHits = 0;        ///< zeros of the exact distance along the same rays
  double different = 0;        ///< zeros that a ray lacks or has too many, summed over the rays
};

/// The zeros of the tricubic interpolant of `band` along fixed rays: chords of a ball about the
/// exact solid between Halton points, evenly spread over all lines. Any first `count` of them are.
[[nodiscard]] RayHits shootRays(const levelset::NarrowBand& band, const Truth& truth,
                                int count = kRayCount);

}  // namespace regress
