// Interpolation between key frames: weights, and lattices between lattices.

#include "levelset/deform/keys/key_weights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "levelset/deform/keys/lattice_keys.h"
#include "levelset/error.h"
#include "tests/support/files.h"

namespace key_weights_test {

using Imath::V3d;
using levelset::blendOf;
using levelset::KeyInterpolation;
using levelset::keyWeights;

const std::vector<double> kTimes = {0, 2, 3, 7};
constexpr std::array kBoth = {KeyInterpolation::Linear, KeyInterpolation::Smooth};

/// Interpolated value of a function that the keys sample.
template <class F>
double blended(const F& value, double time, KeyInterpolation interpolation) {
  return blendOf(keyWeights(kTimes, time, interpolation),
                 [&](std::size_t key) { return value(kTimes[key]); });
}

TEST(KeyWeights, AreOfOneKeyAtItsTimeAndOutside) {
  for (const KeyInterpolation how : kBoth) {
    for (std::size_t k = 0; k < kTimes.size(); ++k) {
      const auto weights = keyWeights(kTimes, kTimes[k], how);
      ASSERT_EQ(weights.size(), 1u);
      EXPECT_EQ(weights[0].key, k);
      EXPECT_EQ(weights[0].weight, 1);
    }
    EXPECT_EQ(keyWeights(kTimes, -1, how).front().key, 0u);
    EXPECT_EQ(keyWeights(kTimes, 8, how).front().key, 3u);
    EXPECT_EQ(keyWeights(std::vector<double>{0}, 5, how).front().key, 0u);
  }
}

TEST(KeyWeights, SumToOneAndKeepConstants) {
  for (const KeyInterpolation how : kBoth)
    for (double t = 0; t <= 7; t += 0.125) {
      double sum = 0;
      for (const levelset::KeyWeight& key : keyWeights(kTimes, t, how)) sum += key.weight;
      EXPECT_NEAR(sum, 1, 4e-16) << t;
      EXPECT_EQ(blended([](double) { return 0.1; }, t, how), 0.1);
    }
}

TEST(KeyWeights, LinearOnesReproduceStraightMotion) {
  const auto line = [](double t) { return 3 - 2 * t; };
  for (double t = 0; t <= 7; t += 0.25)
    EXPECT_NEAR(blended(line, t, KeyInterpolation::Linear), line(t), 4e-15);
}

TEST(KeyWeights, SmoothOnesHaveTheVelocityOfAParabola) {
  const auto value = [](double t) { return std::sin(t) + 0.1 * t * t; };
  const auto at = [&](double t) { return blended(value, t, KeyInterpolation::Smooth); };
  constexpr double kStep = 1e-6;
  for (std::size_t k = 0; k < kTimes.size(); ++k) {
    const double t = kTimes[k];
    const double before = k > 0 ? (at(t) - at(t - kStep)) / kStep : 0,
                 after = k + 1 < kTimes.size() ? (at(t + kStep) - at(t)) / kStep : 0;
    double slope = 0;
    if (k > 0 && k + 1 < kTimes.size()) {
      // The parabola: slopes of both sides, weighted by the opposite lengths.
      const double h = t - kTimes[k - 1], g = kTimes[k + 1] - t;
      slope =
          (g * (value(t) - value(kTimes[k - 1])) / h + h * (value(kTimes[k + 1]) - value(t)) / g) /
          (h + g);
    }
    // One-sided differences with this step.
    EXPECT_NEAR(before, k > 0 ? slope : 0, 5e-6) << k;
    EXPECT_NEAR(after, k + 1 < kTimes.size() ? slope : 0, 5e-6) << k;
  }
  // With two keys: slow at both ends, half way in the middle.
  const std::vector<double> two = {0, 4};
  const auto share = [&](double t) {
    return blendOf(keyWeights(two, t, KeyInterpolation::Smooth),
                   [](std::size_t key) { return key == 0 ? 0.0 : 1.0; });
  };
  EXPECT_EQ(share(2), 0.5);
  EXPECT_EQ(share(1), 0.15625);
}

levelset::ControlLattice latticeWith(double shift, bool isRational = false, int degree = 2) {
  const levelset::LatticeAxis axis = levelset::uniformAxis(degree, 3);
  levelset::LatticeData data =
      levelset::identityLattice({axis, axis, axis}, levelset::frameOf({V3d(-1), V3d(1)})).data();
  data.points[13] += V3d(shift, 0, -shift);
  if (isRational) data.weights.assign(27, 1 + shift);
  return levelset::ControlLattice(data);
}

TEST(LatticeKeys, InterpolateControlPointsAndWeights) {
  for (const bool isRational : {false, true}) {
    const std::vector<levelset::ControlLattice> keys = {
        latticeWith(0, isRational), latticeWith(0.4, isRational), latticeWith(0.1, isRational),
        latticeWith(0.2, isRational)};
    const auto at = [&](double t) {
      return levelset::latticeBetween(keys, keyWeights(kTimes, t, KeyInterpolation::Linear));
    };
    EXPECT_EQ(at(2).data().points, keys[1].data().points);
    EXPECT_EQ(at(2).data().weights, keys[1].data().weights);
    const levelset::LatticeData half = at(2.5).data();
    EXPECT_NEAR((half.points[13] - V3d(0.25, 0, -0.25)).length(), 0, 1e-16);
    EXPECT_EQ(half.points[12], keys[0].data().points[12]);
    if (isRational) {
      EXPECT_NEAR(half.weights[5], 1.25, 3e-16);
    }
  }
}

TEST(LatticeKeys, RefuseLatticesOfAnotherKind) {
  const auto refusal = [](const levelset::ControlLattice& other) {
    return support::refusal<levelset::InvalidInput>([&] {
      levelset::requireSameLattices({latticeWith(0), latticeWith(1), other});
    });
  };
  EXPECT_NE(refusal(latticeWith(0, true)).find("weights"), std::string::npos);
  EXPECT_NE(refusal(latticeWith(0, false, 1)).find("lattice 3"), std::string::npos);
  levelset::LatticeData data = latticeWith(0).data();
  data.boxToWorld[3][0] += 1;
  EXPECT_NE(refusal(levelset::ControlLattice(data)).find("the box"), std::string::npos);
  EXPECT_NO_THROW(levelset::requireSameLattices({latticeWith(0), latticeWith(1)}));
}

}  // namespace key_weights_test
