#include "levelset/points/projection/height_polynomial.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "tests/support/measured.h"

namespace height_polynomial_test {

using levelset::points::fitHeights;
using levelset::points::fitHeightsByPrediction;
using levelset::points::HeightJet;
using levelset::points::HeightPolynomial;
using levelset::points::HeightSample;
using support::doubleRounding;

constexpr double kCondition = 300;

/// Samples of a function on a jittered lattice of spacing 1 about the origin, with Gaussian
/// weights.
template <class Function>
std::vector<HeightSample> samplesOf(const Function& function, double width = 1) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> jitter(-0.15, 0.15);
  std::vector<HeightSample> samples;
  const int reach = static_cast<int>(4 * width);
  for (int i = -reach; i <= reach; ++i)
    for (int j = -reach; j <= reach; ++j) {
      const double x = i + jitter(random), y = j + jitter(random);
      samples.push_back({x, y, function(x, y), std::exp(-(x * x + y * y) / (width * width))});
    }
  return samples;
}

double cubic(double x, double y) {
  return 0.3 - 0.2 * x + y + 0.5 * x * x - x * y + 0.25 * y * y + 0.1 * x * x * x - 0.3 * x * y * y;
}

TEST(HeightPolynomial, ReproducesAPlaneAndAQuadric) {
  const auto plane =
      fitHeights(samplesOf([](double x, double y) { return 2 - x + 3 * y; }), 5, kCondition);
  ASSERT_TRUE(plane);
  EXPECT_GE(plane->degree, 3);
  EXPECT_NEAR(plane->value(0.4, -0.7), 2 - 0.4 - 2.1, doubleRounding(100));
  const auto quadric = fitHeights(
      samplesOf([](double x, double y) { return x * x - 0.5 * x * y + 2 * y * y; }), 5, kCondition);
  ASSERT_TRUE(quadric);
  EXPECT_NEAR(quadric->value(0.5, 0.5), 0.25 - 0.125 + 0.5, doubleRounding(100));
  EXPECT_NEAR(quadric->jet(0, 0).xy, -0.5, doubleRounding(1000));
  EXPECT_NEAR(quadric->jet(0, 0).yy, 4, doubleRounding(1000));
}

TEST(HeightPolynomial, DerivativesAreThoseOfItsValues) {
  const auto fit = fitHeights(samplesOf(cubic), 5, kCondition);
  ASSERT_TRUE(fit);
  const double x = 0.3, y = -0.6, step = 1e-4;
  const HeightJet jet = fit->jet(x, y);
  EXPECT_NEAR(jet.value, cubic(x, y), doubleRounding(100));
  EXPECT_NEAR(jet.value, fit->value(x, y), doubleRounding(10));
  const auto at = [&](double i, double j) { return fit->value(x + i * step, y + j * step); };
  EXPECT_NEAR(jet.x, (at(1, 0) - at(-1, 0)) / (2 * step), 1e-8);
  EXPECT_NEAR(jet.y, (at(0, 1) - at(0, -1)) / (2 * step), 1e-8);
  EXPECT_NEAR(jet.xx, (at(1, 0) - 2 * at(0, 0) + at(-1, 0)) / (step * step), 1e-6);
  EXPECT_NEAR(jet.yy, (at(0, 1) - 2 * at(0, 0) + at(0, -1)) / (step * step), 1e-6);
  EXPECT_NEAR(jet.xy, (at(1, 1) - at(1, -1) - at(-1, 1) + at(-1, -1)) / (4 * step * step), 1e-6);
}

TEST(HeightPolynomial, LowersTheDegreeNearAnAlgebraicCurve) {
  EXPECT_EQ(fitHeights(samplesOf(cubic), 5, kCondition)->degree, 4);
  EXPECT_EQ(fitHeights(samplesOf(cubic, 2), 5, kCondition)->degree, 3);
  // Points of a circle lie on a curve of degree 2.
  std::vector<HeightSample> circle;
  for (int i = 0; i < 40; ++i) circle.push_back({std::cos(0.157 * i), std::sin(0.157 * i), 1, 1});
  EXPECT_EQ(fitHeights(circle, 5, kCondition)->degree, 1);
  std::vector<HeightSample> line;
  for (int i = 0; i < 40; ++i) line.push_back({0.1 * i, 0.2 * i, 1, 1});
  EXPECT_FALSE(fitHeights(line, 5, kCondition));
  EXPECT_FALSE(fitHeights(std::vector<HeightSample>{{0, 0, 0, 1}}, 5, kCondition));
}

TEST(HeightPolynomial, ByPredictionHasALowDegreeForNoise) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.1);
  // Three spacings off, a polynomial of high degree swings.
  const auto squaredError = [](const HeightPolynomial& fit) {
    const double miss = fit.value(3, 0) - (2 - 3);
    return miss * miss;
  };
  constexpr int kClouds = 100;
  double ofChosen = 0, ofGreatest = 0, degrees = 0;
  for (int cloud = 0; cloud < kClouds; ++cloud) {
    const auto noisy = samplesOf([&](double x, double y) { return 2 - x + 3 * y + noise(random); });
    const auto chosen = fitHeightsByPrediction(noisy, 5, kCondition),
               greatest = fitHeights(noisy, 5, kCondition);
    ASSERT_TRUE(chosen && greatest);
    degrees += static_cast<double>(chosen->degree) / kClouds;
    ofChosen += squaredError(*chosen);
    ofGreatest += squaredError(*greatest);
  }
  EXPECT_LT(degrees, support::measured(1.93));
  EXPECT_LT(ofChosen / ofGreatest, support::measured(0.484));
  const auto exact = fitHeightsByPrediction(samplesOf(cubic), 5, kCondition);
  ASSERT_TRUE(exact);
  EXPECT_GE(exact->degree, 3);
  EXPECT_NEAR(exact->value(0.4, -0.3), cubic(0.4, -0.3), doubleRounding(100));
}

}  // namespace height_polynomial_test
