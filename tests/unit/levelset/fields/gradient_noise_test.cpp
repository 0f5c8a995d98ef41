#include "levelset/fields/gradient_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace gradient_noise_test {

using Imath::V3d;
using levelset::gradientNoise;

TEST(GradientNoise, IsSmoothBoundedAndZeroOnTheLattice) {
  double most = 0;
  for (int i = 0; i < 2000; ++i) {
    const V3d p(0.37 * i - 300, std::sin(i) * 20, std::cos(2.3 * i) * 20);
    EXPECT_EQ(gradientNoise(V3d(std::floor(p.x), std::floor(p.y), std::floor(p.z))), 0);
    most = std::max(most, std::abs(gradientNoise(p)));
    // The slope is at most 4 or so, so a small step changes little, across cells, too.
    EXPECT_LT(std::abs(gradientNoise(p) - gradientNoise(p + V3d(1e-6))), 1e-5);
  }
  EXPECT_LE(most, 1);
  EXPECT_GT(most, 0.6);
}

TEST(GradientNoise, IsFiniteAtHugeAndUndefinedPlaces) {
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(gradientNoise(V3d(1e30, -1e300, 0.5)), gradientNoise(V3d(0, 0, 0.5)));
  EXPECT_EQ(gradientNoise(V3d(kNothing, 0.5, 0.5)), 0);
  // The hash repeats after 2^32 cells.
  const V3d place(0.25, -7.5, 3.75);
  EXPECT_EQ(gradientNoise(place), gradientNoise(place + V3d(0x1p32, -0x1p32, 0x1p34)));
}

}  // namespace gradient_noise_test
