#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "levelset/error.h"
#include "levelset/molecules/ball_union.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

// Volumes of the balls of a union, and the connected pieces of its boundary.

namespace ball_parts_test {

using Imath::V3d;
using levelset::Ball;
using levelset::BallUnion;
using support::measured;
using support::refusal;

constexpr double kPi = std::numbers::pi;

std::vector<Ball> scattered(unsigned seed, int count, double size, double least = 2.4,
                            double most = 3.4) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-size, size), radius(least, most);
  std::vector<Ball> balls;
  for (int n = 0; n < count; ++n)
    balls.push_back({V3d(place(random), place(random), place(random)), radius(random)});
  return balls;
}

/// Balls at the points of a cubic lattice.
std::vector<Ball> latticeOf(int edge, double radius) {
  std::vector<Ball> balls;
  for (int n = 0; n < edge * edge * edge; ++n) {
    const int y = n / edge % edge, z = n / (edge * edge);
    balls.push_back(
        {V3d(static_cast<double>(n % edge), static_cast<double>(y), static_cast<double>(z)),
         radius});
  }
  return balls;
}

/// Balls on a sphere, so dense that they enclose a void.
std::vector<Ball> hollow(double radius, int count, double ballRadius, const V3d& at) {
  std::vector<Ball> balls;
  for (int n = 0; n < count; ++n) {
    const double z = (2 * n + 1.0) / count - 1, ring = std::sqrt(1 - z * z);
    const double angle = n * kPi * (3 - std::sqrt(5));
    balls.push_back(
        {at + V3d(ring * std::cos(angle), ring * std::sin(angle), z) * radius, ballRadius});
  }
  return balls;
}

double sumOf(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum;
}

TEST(BallParts, DivideTwoBallsAtTheirPlane) {
  // The cells are the balls without caps, on the plane at 0.7 from the first centre.
  const double r = 1, s = 0.8, apart = 1.2, plane = (apart * apart + r * r - s * s) / (2 * apart);
  const auto cap = [](double radius, double height) {
    return kPi * height * height * (3 * radius - height) / 3;
  };
  const BallUnion both({{V3d(5), r}, {V3d(5 + apart, 5, 5), s}}, 1);
  const std::vector<double> volumes = both.volumes();
  EXPECT_NEAR(volumes[0], 4 * kPi / 3 - cap(r, r - plane), 1e-14);
  EXPECT_NEAR(volumes[1], 4 * kPi / 3 * s * s * s - cap(s, s - (apart - plane)), 1e-14);
}

TEST(BallParts, AddUpToTheVolumeOfTheUnion) {
  double worst = 0;
  const auto offer = [&](const std::vector<Ball>& balls) {
    const BallUnion all(balls, 1);
    const double volume = all.exposure().volume;
    worst = std::max(worst, std::abs(sumOf(all.volumes()) / volume - 1));
    double area = 0, enclosed = 0;
    for (const BallUnion::Boundary& boundary : all.boundaries()) {
      area += boundary.area;
      enclosed += boundary.volume;
    }
    worst = std::max(worst, std::abs(enclosed / volume - 1));
    worst = std::max(worst, std::abs(area / sumOf(all.exposure().areas) - 1));
  };
  for (unsigned seed = 1; seed < 20; ++seed) {
    offer(scattered(seed, 60, 8));
    offer(scattered(seed, 40, 4, 0.1, 4));
  }
  for (const double radius : {0.5, 0.55, 0.6, std::sqrt(0.5), 0.75, std::sqrt(0.75), 1.0, 1.5})
    offer(latticeOf(4, radius));
  EXPECT_LT(worst, 1e-10);
}

TEST(BallParts, AreTheCellsOfThePowerDiagram) {
  // Points of a grid belong to the ball of the least power.
  const std::vector<Ball> balls = scattered(3, 15, 3, 0.8, 2.5);
  const std::vector<double> volumes = BallUnion(balls, 1).volumes();
  std::vector<double> sampled(balls.size(), 0);
  constexpr double kStep = 0.08;
  constexpr int kAcross = 150;
  const auto placeOf = [](int n) { return -6 + n * kStep; };
  for (int i = 0; i < kAcross; ++i)
    for (int j = 0; j < kAcross; ++j)
      for (int k = 0; k < kAcross; ++k) {
        const V3d p(placeOf(i), placeOf(j), placeOf(k));
        std::size_t best = 0;
        double least = 1;
        for (std::size_t n = 0; n < balls.size(); ++n) {
          const double power = (p - balls[n].centre).length2() - balls[n].radius * balls[n].radius;
          if (power < least) {
            least = power;
            best = n;
          }
        }
        if (least <= 0) sampled[best] += kStep * kStep * kStep;
      }
  double worst = 0;
  for (std::size_t n = 0; n < balls.size(); ++n)
    worst = std::max(worst, std::abs(sampled[n] - volumes[n]));
  EXPECT_LT(worst, measured(0.0098));
  EXPECT_GT(*std::max_element(volumes.begin(), volumes.end()), 10);
}

TEST(BallParts, GiveBallsInsideOthersNoVolume) {
  const std::vector<double> volumes =
      BallUnion({{V3d(0), 2}, {V3d(0.5, 0, 0), 1}, {V3d(0), 2}, {V3d(9, 0, 0), 1}}, 1).volumes();
  EXPECT_NEAR(volumes[0], 32 * kPi / 3, 1e-13);
  EXPECT_EQ(volumes[1], 0);
  EXPECT_EQ(volumes[2], 0);
  EXPECT_NEAR(volumes[3], 4 * kPi / 3, 1e-14);
}

/// Signs of the volumes of the pieces, with their number.
std::array<std::size_t, 2> outerAndInner(const std::vector<Ball>& balls) {
  std::array<std::size_t, 2> counts{};
  for (const BallUnion::Boundary& boundary : BallUnion(balls, 1).boundaries())
    ++counts[boundary.volume < 0];
  return counts;
}

TEST(BallParts, FindTheCavities) {
  using Counts = std::array<std::size_t, 2>;
  // A hollow sphere, with a ball that floats in it, and another one beside it.
  std::vector<Ball> balls = hollow(5, 100, 1.5, V3d(0));
  EXPECT_EQ(outerAndInner(balls), (Counts{1, 1}));
  balls.push_back({V3d(0.3, 0, 0), 1});
  EXPECT_EQ(outerAndInner(balls), (Counts{2, 1}));
  const std::vector<Ball> other = hollow(4, 60, 1.5, V3d(30, 1, 2));
  balls.insert(balls.end(), other.begin(), other.end());
  EXPECT_EQ(outerAndInner(balls), (Counts{3, 2}));
  // A ball with a rod of balls through it: the exposed part of the ball is a ring.
  std::vector<Ball> rod = {{V3d(0), 3}};
  for (int n = -6; n <= 6; ++n) rod.push_back({V3d(0, 0, n), 1});
  EXPECT_EQ(outerAndInner(rod), (Counts{1, 0}));
  // A ring of balls has one surface. In a lattice of balls, each cube has a void.
  std::vector<Ball> ring;
  for (int n = 0; n < 12; ++n)
    ring.push_back({V3d(std::cos(n * kPi / 6), std::sin(n * kPi / 6), 0) * 4, 1.5});
  EXPECT_EQ(outerAndInner(ring), (Counts{1, 0}));
  EXPECT_EQ(outerAndInner(latticeOf(3, 0.75)), (Counts{1, 8}));
  EXPECT_EQ(outerAndInner(latticeOf(3, 0.6)), (Counts{1, 0}));
  EXPECT_EQ(outerAndInner(latticeOf(3, 0.49)), (Counts{27, 0}));
}

TEST(BallParts, MeasureACavity) {
  // The void between eight balls at the corners of a cube. One eighth of it is in each octant.
  const double radius = 0.75;
  const std::vector<BallUnion::Boundary> pieces = BallUnion(latticeOf(2, radius), 1).boundaries();
  ASSERT_EQ(pieces.size(), 2u);
  const BallUnion::Boundary& inner = pieces[0].volume < 0 ? pieces[0] : pieces[1];
  EXPECT_EQ(inner.balls.size(), 8u);
  double sampled = 0;
  constexpr int kSamples = 200;
  for (int n = 0; n < kSamples * kSamples * kSamples; ++n) {
    const V3d p((n % kSamples + 0.5) / kSamples, (n / kSamples % kSamples + 0.5) / kSamples,
                (n / kSamples / kSamples + 0.5) / kSamples);
    const V3d q(std::min(p.x, 1 - p.x), std::min(p.y, 1 - p.y), std::min(p.z, 1 - p.z));
    sampled += q.length() > radius;
  }
  sampled /= kSamples * kSamples * kSamples;
  EXPECT_NEAR(-inner.volume / sampled, 1, measured(1e-3));
}

TEST(BallParts, RefuseToExceedAMemoryLimit) {
  const BallUnion all(scattered(10, 300, 18), 3);
  EXPECT_FALSE(refusal<levelset::ResourceLimit>([&] { (void)all.volumes(20'000); }).empty());
  EXPECT_FALSE(refusal<levelset::ResourceLimit>([&] { (void)all.boundaries(20'000); }).empty());
  EXPECT_EQ(all.volumes(1'000'000), all.volumes());
  EXPECT_EQ(all.boundaries(1'000'000).size(), all.boundaries().size());
}

TEST(BallParts, HaveTheSameBitsOnAnyNumberOfThreads) {
  const std::vector<Ball> balls = scattered(10, 300, 18);
  const auto figures = [&] {
    const BallUnion all(balls, 3);
    std::vector<double> values = all.volumes();
    for (const BallUnion::Boundary& boundary : all.boundaries()) values.push_back(boundary.volume);
    return values;
  };
  EXPECT_EQ(support::onThreads(1, figures), support::onThreads(7, figures));
}

}  // namespace ball_parts_test
