#include "levelset/deform/keys/motion_certificate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "levelset/deform/keys/key_weights.h"
#include "levelset/deform/lattice_certificate.h"
#include "levelset/error.h"

namespace motion_certificate_test {

using namespace levelset;
using Imath::V3d;

ControlLattice rotated(const ControlLattice& lattice, double angle) {
  LatticeData data = lattice.data();
  const double c = std::cos(angle), s = std::sin(angle);
  for (V3d& p : data.points) p = V3d(c * p.x - s * p.y, s * p.x + c * p.y, p.z);
  return ControlLattice(std::move(data));
}

ControlLattice restOf(int degree, std::size_t count) {
  return identityLattice(
      {uniformAxis(degree, count), uniformAxis(degree, count), uniformAxis(1, 2)},
      frameOf({V3d(-1, -1, -2), V3d(1, 1, 2)}));
}

ControlLattice shaken(const ControlLattice& lattice, double most, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> shift(-most, most);
  LatticeData data = lattice.data();
  for (V3d& p : data.points) p += V3d(shift(random), shift(random), shift(random));
  return ControlLattice(std::move(data));
}

/// The lattice at a time, by the de Casteljau algorithm.
ControlLattice latticeAt(const std::vector<ControlLattice>& control, double time) {
  std::vector<std::vector<V3d>> row;
  for (const ControlLattice& lattice : control) row.push_back(lattice.data().points);
  for (; row.size() > 1; row.pop_back())
    for (std::size_t k = 0; k + 1 < row.size(); ++k)
      for (std::size_t n = 0; n < row[k].size(); ++n)
        row[k][n] = row[k][n] * (1 - time) + row[k + 1][n] * time;
  LatticeData data = control.front().data();
  data.points = row.front();
  return ControlLattice(std::move(data));
}

/// Control points of a rotation move along chords. In the middle the cross-section has shrunk to
/// the cosine of half the angle.
TEST(MotionCertificate, BracketsTheShrinkingOfARotation) {
  for (const int degree : {1, 3})
    for (const double angle : {0.5, 1.5, 2.5}) {
      const ControlLattice rest = restOf(degree, 5);
      const MotionCertificate found =
          certifyMotion({rest, rotated(rest, angle)}, {.tolerance = 1e-3});
      const double exact = std::pow(std::cos(0.5 * angle), 2);
      EXPECT_EQ(found.verdict, FoldVerdict::Certified);
      // Both include the bound of the rounding errors.
      EXPECT_LE(found.leastLow, exact * (1 + 1e-12));
      EXPECT_GE(found.leastHigh, exact * (1 - 1e-10));
      EXPECT_LE(found.leastHigh - found.leastLow, 1e-3 * found.leastHigh * (1 + 1e-12));
      EXPECT_NEAR(found.time, 0.5, 0.02);
    }
}

TEST(MotionCertificate, FindsTheTimeAtWhichHalfATurnIsFlat) {
  const ControlLattice rest = restOf(2, 4);
  const MotionCertificate found = certifyMotion({rest, rotated(rest, std::numbers::pi)});
  EXPECT_EQ(found.verdict, FoldVerdict::Folds);
  EXPECT_EQ(found.time, 0.5);
  EXPECT_LT(found.leastHigh, 1e-9);
}

TEST(MotionCertificate, AMotionlessLatticeHasTheBracketOfItsLattice) {
  const ControlLattice lattice = shaken(restOf(3, 6), 0.05, 4);
  const MotionCertificate found = certifyMotion({lattice, lattice}, {.tolerance = 0.01});
  const FoldCertificate still = certifyLattice(lattice);
  EXPECT_EQ(found.verdict, FoldVerdict::Certified);
  EXPECT_LE(found.leastLow, still.leastHigh);
  EXPECT_GE(found.leastHigh, still.leastLow);
}

TEST(MotionCertificate, NoSampleIsBelowTheBound) {
  for (unsigned seed = 0; seed < 6; ++seed) {
    const ControlLattice rest = restOf(2, 4);
    std::vector<ControlLattice> control;
    for (unsigned k = 0; k < (seed % 2 ? 4U : 2U); ++k)
      control.push_back(shaken(rotated(rest, 0.3 * k), 0.12, 10 * seed + k));
    const MotionCertificate found = certifyMotion(control);
    ASSERT_NE(found.verdict, FoldVerdict::Undecided) << seed;
    double least = std::numeric_limits<double>::infinity();
    for (int t = 0; t <= 16; ++t) {
      const ControlLattice at = latticeAt(control, t / 16.0);
      for (int i = 0; i <= 8; ++i)
        for (int j = 0; j <= 8; ++j)
          for (int k = 0; k <= 2; ++k)
            least =
                std::min(least, at.jet(at.worldOf(V3d(i / 8.0, j / 8.0, k / 2.0))).determinant());
    }
    if (found.verdict == FoldVerdict::Certified) {
      EXPECT_GE(least, found.leastLow);
      EXPECT_LE(found.leastHigh, least * 1.06);
    }
    const ControlLattice there = latticeAt(control, found.time);
    EXPECT_NEAR(there.jet(found.place).determinant(), found.leastHigh, 1e-9);
  }
}

TEST(MotionCertificate, LimitsMemoryAndLeavesWeightsUndecided) {
  const ControlLattice rest = restOf(3, 8);
  EXPECT_THROW(
      (void)certifyMotion({rest, rotated(rest, 2.9)}, {.tolerance = 1e-6, .maxMemory = 1000}),
      ResourceLimit);
  LatticeData data = rest.data();
  data.weights.assign(data.points.size(), 1.0);
  const ControlLattice weighted{data};
  EXPECT_EQ(certifyMotion({weighted, weighted}).verdict, FoldVerdict::Undecided);
}

/// The control values of a motion give the interpolated values at all times.
TEST(KeyWeights, ControlValuesOfAMotionGiveItsValues) {
  const std::vector<double> times = {0, 2, 3, 7}, values = {1, -2, 0.5, 4};
  const auto valueOf = [&](std::size_t key) { return values[key]; };
  for (const KeyInterpolation how : {KeyInterpolation::Linear, KeyInterpolation::Smooth})
    for (std::size_t interval = 0; interval < 3; ++interval) {
      const auto control = motionWeights(times, interval, how);
      ASSERT_EQ(control.size(), how == KeyInterpolation::Linear ? 2U : 4U);
      for (const double s : {0.0, 0.2, 0.5, 0.9, 1.0}) {
        std::vector<double> row;
        for (const auto& weights : control) row.push_back(blendOf(weights, valueOf));
        for (; row.size() > 1; row.pop_back())
          for (std::size_t k = 0; k + 1 < row.size(); ++k)
            row[k] = row[k] * (1 - s) + row[k + 1] * s;
        const double time = times[interval] + s * (times[interval + 1] - times[interval]);
        EXPECT_NEAR(row[0], blendOf(keyWeights(times, time, how), valueOf), 1e-14);
      }
    }
}

}  // namespace motion_certificate_test
