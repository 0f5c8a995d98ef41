#include "levelset/hamilton_jacobi/cut_off.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "tests/support/measured.h"

namespace cut_off_test {

using levelset::flow::cutOff;

constexpr std::pair<double, double> kWidths[] = {{2, 4}, {3, 6}, {0, 1}};

TEST(CutOff, IsOneInTheMiddleAndZeroAtTheEnd) {
  for (const auto& [full, zero] : kWidths) {
    for (const double d : {0.0, full / 2, full}) {
      EXPECT_EQ(cutOff(d, full, zero), 1) << full;
      EXPECT_EQ(cutOff(-d, full, zero), 1) << full;
    }
    for (const double d : {zero, zero + 0.1, 2 * zero}) {
      EXPECT_EQ(cutOff(d, full, zero), 0) << full;
      EXPECT_EQ(cutOff(-d, full, zero), 0) << full;
    }
  }
}

TEST(CutOff, HasTheValuesOfTheCubic) {
  // With s = (|φ| − β)/(γ − β), equation 6.16 is (1 − s)² (1 + 2 s).
  for (const auto& [full, zero] : kWidths)
    for (const double s : {0.1, 0.25, 0.5, 0.9})
      for (const double side : {-1.0, 1.0})
        EXPECT_NEAR(cutOff(side * (full + s * (zero - full)), full, zero),
                    (1 - s) * (1 - s) * (1 + 2 * s), support::doubleRounding(4))
            << full << " " << s;
  EXPECT_NEAR(cutOff(4.5, 3, 6), 0.5, support::doubleRounding(1));
}

TEST(CutOff, DoesNotDependOnTheUnit) {
  for (const double d : {-5.0, -4.0, 3.5, 4.5, 5.9})
    EXPECT_NEAR(cutOff(d * 1e-3, 3e-3, 6e-3), cutOff(d, 3, 6), support::doubleRounding(8)) << d;
}

TEST(CutOff, IsContinuousWithItsSlope) {
  // Values and slopes on both sides of the joints agree to the first order of the step.
  for (const auto& [full, zero] : kWidths)
    for (const double joint : {full, zero}) {
      const double step = 1e-5 * (zero - full);
      const double before = cutOff(joint - step, full, zero), at = cutOff(joint, full, zero),
                   after = cutOff(joint + step, full, zero);
      // The curvature at the joints is ± 6 / (γ − β)².
      EXPECT_NEAR(before, at, 3.1e-10) << full << " " << joint;
      EXPECT_NEAR(after, at, 3.1e-10) << full << " " << joint;
      EXPECT_NEAR((after - before) / (2e-5), 0, 1.6e-5) << full << " " << joint;
    }
}

TEST(CutOff, FallsMonotonically) {
  double previous = 1;
  for (double d = 3.01; d < 6; d += 0.01) {
    const double now = cutOff(d, 3, 6);
    EXPECT_LT(now, previous) << d;
    previous = now;
  }
}

}  // namespace cut_off_test
