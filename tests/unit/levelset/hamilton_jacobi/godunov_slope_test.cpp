#include "levelset/hamilton_jacobi/hamiltonian.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/measured.h"

namespace godunov_slope_test {

using levelset::flow::godunovSlope;
using levelset::flow::OneSidedSlopes;

TEST(GodunovSlope, IsTheNormWhereBothSidesAgree) {
  const OneSidedSlopes d{{2, -3, 6}, {2, -3, 6}};
  for (const double speed : {0.1, -0.1, 5.0, -5.0})
    EXPECT_NEAR(godunovSlope(d, speed), 7, support::doubleRounding(8)) << speed;
  EXPECT_EQ(godunovSlope(d, 0), 0);
}

TEST(GodunovSlope, IsZeroAtAKinkThatTheFrontLeaves) {
  // A valley of φ: a front that moves to higher φ leaves it on both sides.
  const OneSidedSlopes valley{{-1, 0, 0}, {2, 0, 0}}, ridge{{1, 0, 0}, {-2, 0, 0}};
  EXPECT_EQ(godunovSlope(valley, 1), 0);
  EXPECT_EQ(godunovSlope(ridge, -1), 0);
}

TEST(GodunovSlope, TakesTheSteeperSideAtAKinkThatFrontsMeetAt) {
  const OneSidedSlopes valley{{-1, 0, 0}, {2, 0, 0}}, ridge{{1, 0, 0}, {-2, 0, 0}};
  EXPECT_EQ(godunovSlope(valley, -1), 2);
  EXPECT_EQ(godunovSlope(ridge, 1), 2);
}

TEST(GodunovSlope, SolvesTheRiemannProblem) {
  // Godunov's flux of H(p) = F |p| is the minimum of H on [φ⁻, φ⁺], or the maximum on [φ⁺, φ⁻].
  for (const double speed : {1.0, -1.0})
    for (double behind = -2; behind <= 2; behind += 0.25)
      for (double ahead = -2; ahead <= 2; ahead += 0.25) {
        double flux = speed * std::abs(behind);
        const bool isMinimum = behind <= ahead;
        for (int i = 0; i <= 64; ++i) {
          const double h = speed * std::abs(behind + (ahead - behind) * i / 64);
          flux = isMinimum ? std::min(flux, h) : std::max(flux, h);
        }
        // The samples of the interval miss its zero by up to 1/32.
        EXPECT_NEAR(speed * godunovSlope({{behind, 0, 0}, {ahead, 0, 0}}, speed), flux, 0.032)
            << behind << " " << ahead;
      }
}

TEST(GodunovSlope, MirrorsWithTheAxes) {
  const OneSidedSlopes d{{0.5, -1, 0.3}, {-0.25, 2, 0.7}};
  OneSidedSlopes mirrored;
  for (int axis = 0; axis < 3; ++axis) {
    mirrored.lower[axis] = -d.upper[axis];
    mirrored.upper[axis] = -d.lower[axis];
  }
  for (const double speed : {1.0, -1.0})
    EXPECT_EQ(godunovSlope(mirrored, speed), godunovSlope(d, speed));
}

}  // namespace godunov_slope_test
