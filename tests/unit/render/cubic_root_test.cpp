#include "render/embree/cubic_root.h"
#include "tests/support/measured.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace cubic_root_test {

using render::BernsteinCubic;
using render::firstSignChange;
using render::hasSignChange;

/// (t - r0)(t - r1)(t - r2), by its blossom.
BernsteinCubic withRoots(double r0, double r1, double r2) {
  const auto blossom = [&](double a, double b, double c) {
    const auto term = [&](double x, double y, double z) { return (x - r0) * (y - r1) * (z - r2); };
    return (term(a, b, c) + term(a, c, b) + term(b, a, c) + term(b, c, a) + term(c, a, b) +
            term(c, b, a)) /
           6;
  };
  return {blossom(0, 0, 0), blossom(0, 0, 1), blossom(0, 1, 1), blossom(1, 1, 1)};
}

double valueAt(const BernsteinCubic& b, double t) {
  const double s = 1 - t;
  return b[0] * s * s * s + 3 * b[1] * s * s * t + 3 * b[2] * s * t * t + b[3] * t * t * t;
}

TEST(CubicRoot, FindsASingleRoot) {
  EXPECT_NEAR(firstSignChange(withRoots(0.3, -2, 5)), 0.3, support::doubleRounding(1));
  EXPECT_NEAR(firstSignChange(withRoots(1e-9, -2, 5)), 1e-9, support::doubleRounding(1));
  EXPECT_NEAR(firstSignChange(withRoots(1 - 1e-9, -2, 5)), 1 - 1e-9, support::doubleRounding(4));
}

TEST(CubicRoot, TakesTheFirstOfThree) {
  EXPECT_NEAR(firstSignChange(withRoots(0.9, 0.2, 0.5)), 0.2, support::doubleRounding(1));
}

TEST(CubicRoot, FindsTwoRootsBetweenEqualSigns) {
  for (const double gap : {1e-1, 1e-3, 1e-6}) {
    const BernsteinCubic cubic = withRoots(0.37 - gap, 0.37 + gap, 3);
    EXPECT_TRUE(hasSignChange(cubic));
    // The slope at the root is about 5 gap, the coefficients carry 1e-16.
    EXPECT_NEAR(firstSignChange(cubic), 0.37 - gap, 1e-15 + 1e-15 / gap);
  }
}

TEST(CubicRoot, FindsNoRootWhereThereIsNone) {
  for (const BernsteinCubic& cubic :
       {BernsteinCubic{1, 2, 3, 4}, BernsteinCubic{-1, -2, -1, -4}, BernsteinCubic{0, 0, 0, 0},
        BernsteinCubic{1, -0.3, -0.3, 1}, withRoots(-1e-9, -1, -2), withRoots(0.5, 0.5, -1)}) {
    EXPECT_LT(firstSignChange(cubic), 0);
    EXPECT_FALSE(hasSignChange(cubic));
  }
}

TEST(CubicRoot, AgreesWithSamplingOnRandomCubics) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> coefficient(-1, 1);
  int found = 0;
  for (int i = 0; i < 20000; ++i) {
    BernsteinCubic b;
    for (double& c : b) c = coefficient(random);
    const double root = firstSignChange(b);
    ASSERT_EQ(root >= 0, hasSignChange(b));
    const double end = root >= 0 ? root : 1;
    found += root >= 0;
    if (root >= 0) {
      ASSERT_NEAR(valueAt(b, root), 0, support::doubleRounding(3));
    }
    for (int k = 0; k < 50; ++k) {
      const double value = valueAt(b, end * k / 50);
      ASSERT_TRUE(std::abs(value) < 1e-14 || (value < 0) == (b[0] < 0)) << i << ' ' << k;
    }
  }
  EXPECT_GT(found, 5000);
}

}  // namespace cubic_root_test
