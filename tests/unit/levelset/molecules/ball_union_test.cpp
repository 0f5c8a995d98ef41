#include "levelset/molecules/ball_union.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "levelset/error.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace ball_union_test {

using Imath::V3d;
using levelset::Ball;
using levelset::BallUnion;
using levelset::InvalidInput;
using support::measured;
using support::refusal;

constexpr double kPi = std::numbers::pi;

std::vector<Ball> randomBalls(unsigned seed, int count, double size, const V3d& at = V3d(0)) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-size, size), radius(2.4, 3.4);
  std::vector<Ball> balls;
  for (int n = 0; n < count; ++n)
    balls.push_back({at + V3d(place(random), place(random), place(random)), radius(random)});
  return balls;
}

/// Point n of a cubic lattice with `edge` points along each edge.
V3d latticePoint(int n, int edge) {
  const int y = n / edge % edge, z = n / (edge * edge);
  return {static_cast<double>(n % edge), static_cast<double>(y), static_cast<double>(z)};
}

bool isInside(const std::vector<Ball>& balls, const V3d& p, double margin) {
  return std::any_of(balls.begin(), balls.end(), [&](const Ball& ball) {
    return (p - ball.centre).length() < ball.radius - margin;
  });
}

/// Signed distance by all spheres, all circles of two and all corners of three balls.
double distanceByAll(const std::vector<Ball>& balls, const V3d& p) {
  double outside = std::numeric_limits<double>::infinity(), inside = outside;
  for (const Ball& ball : balls)
    outside = std::min(outside, (p - ball.centre).length() - ball.radius);
  if (outside >= 0) return outside;
  const auto offer = [&](const V3d& x) {
    if (!isInside(balls, x, 1e-9)) inside = std::min(inside, (x - p).length());
  };
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const Ball& a = balls[i];
    offer(a.centre + (p - a.centre).normalized() * a.radius);
    for (std::size_t j = i + 1; j < balls.size(); ++j) {
      const Ball& b = balls[j];
      const V3d between = b.centre - a.centre, axis = between.normalized();
      const double apart = between.length();
      const double plane =
          (apart * apart + a.radius * a.radius - b.radius * b.radius) / (2 * apart);
      const double squared = a.radius * a.radius - plane * plane;
      if (squared <= 0) continue;
      const V3d centre = a.centre + axis * plane;
      const V3d aside = p - centre - axis * axis.dot(p - centre);
      offer(centre + aside.normalized() * std::sqrt(squared));
      for (std::size_t k = j + 1; k < balls.size(); ++k) {
        // Points of the circle at the distance of the radius from the third centre.
        const Ball& c = balls[k];
        const V3d from = c.centre - centre, flat = from - axis * axis.dot(from);
        const double radius = std::sqrt(squared), length = flat.length();
        const double cosine =
            (from.length2() + squared - c.radius * c.radius) / (2 * radius * length);
        if (std::abs(cosine) > 1) continue;
        const V3d u = flat / length, v = axis.cross(u);
        const double sine = std::sqrt(1 - cosine * cosine);
        offer(centre + (u * cosine + v * sine) * radius);
        offer(centre + (u * cosine - v * sine) * radius);
      }
    }
  }
  return -inside;
}

/// Area of the sphere of a ball outside the others: the exact angle outside at many latitudes.
double areaByLatitudes(const std::vector<Ball>& balls, std::size_t own) {
  constexpr int kLatitudes = 20'000;
  const Ball& ball = balls[own];
  double sum = 0;
  for (int n = 0; n < kLatitudes; ++n) {
    const double z = (2 * n + 1.0) / kLatitudes - 1, ring = std::sqrt(1 - z * z) * ball.radius;
    std::vector<std::array<double, 2>> covered;
    bool isHidden = false;
    for (std::size_t k = 0; k < balls.size(); ++k) {
      if (k == own) continue;
      const V3d to = balls[k].centre - ball.centre;
      const double across = std::hypot(to.x, to.y), rise = to.z - z * ball.radius;
      const double level =
          ring * ring + across * across + rise * rise - balls[k].radius * balls[k].radius;
      const double most = 2 * ring * across;
      if (level >= most) continue;
      if (level <= -most) {
        isHidden = true;
        break;
      }
      const double half = std::acos(level / most), middle = std::atan2(to.y, to.x);
      for (const double turn : {-2 * kPi, 0.0, 2 * kPi})
        covered.push_back(
            {std::max(middle - half + turn, -kPi), std::min(middle + half + turn, kPi)});
    }
    if (isHidden) continue;
    std::sort(covered.begin(), covered.end());
    double open = 0, reached = -kPi;
    for (const auto& [begin, end] : covered) {
      if (end <= begin) continue;
      open += std::max(0.0, begin - reached);
      reached = std::max(reached, end);
    }
    sum += open + std::max(0.0, kPi - reached);
  }
  return sum * 2 / kLatitudes * ball.radius * ball.radius;
}

TEST(BallUnion, MeasuresTwoBalls) {
  const double apart = 1.2, cap = 1 - apart / 2;
  const BallUnion both({{V3d(0), 1}, {V3d(apart, 0, 0), 1}}, 1);
  for (const double area : both.exposure().areas) EXPECT_NEAR(area, 4 * kPi - 2 * kPi * cap, 1e-14);
  EXPECT_NEAR(both.exposure().volume, 8 * kPi / 3 - 2 * kPi * cap * cap * (3 - cap) / 3, 1e-14);
  EXPECT_NEAR(both.distance(V3d(0.6, 0.3, 0)), -0.5, 1e-15);
  EXPECT_NEAR(both.distance(V3d(-0.5, 0, 0)), -0.5, 1e-15);
  EXPECT_NEAR(both.distance(V3d(0.6, 2, 0)), std::hypot(0.6, 2) - 1, 1e-15);
}

TEST(BallUnion, HasExactDistancesOnBothSides) {
  constexpr double kDepth = 2.5;
  for (const V3d& at : {V3d(0), V3d(1e6, -2e6, 3e6)}) {
    const std::vector<Ball> balls = randomBalls(5, 14, 4, at);
    const BallUnion all(balls, kDepth);
    std::mt19937 random(6);
    std::uniform_real_distribution<double> place(-10, 10);
    int inside = 0, deep = 0;
    double worst = 0;
    for (int n = 0; n < 3000; ++n) {
      const V3d p = at + V3d(place(random), place(random), place(random)) * (n % 2 ? 0.5 : 1);
      const BallUnion::Foot foot = all.closest(p);
      const double truth = distanceByAll(balls, p);
      inside += truth < 0;
      if (!foot.isExact) {
        ++deep;
        EXPECT_LE(truth, foot.distance);
        EXPECT_LE(foot.distance, -kDepth);
        continue;
      }
      worst = std::max(worst, std::abs(foot.distance - truth));
      worst = std::max(worst, std::abs((foot.point - p).length() - std::abs(truth)));
    }
    EXPECT_GT(inside, 1000);
    EXPECT_GT(deep, 3);
    EXPECT_LT(worst, at == V3d(0) ? 1e-13 : 1e-9);  // coordinates of 1e6 have errors of 2e-10
  }
}

TEST(BallUnion, HasTheAreasOfRandomBalls) {
  double worst = 0;
  for (const unsigned seed : {1U, 2U, 3U}) {
    const std::vector<Ball> balls = randomBalls(seed, 25, 5);
    const std::vector<double> areas = BallUnion(balls, 1).exposure().areas;
    for (std::size_t n = 0; n < balls.size(); ++n)
      worst = std::max(worst, std::abs(areas[n] - areaByLatitudes(balls, n)));
  }
  EXPECT_LT(worst, measured(3.8e-4));  // that of the latitudes
}

TEST(BallUnion, GrowsByItsArea) {
  // The volume changes with a common growth of the radii by the area.
  const std::vector<Ball> balls = randomBalls(4, 30, 5);
  const auto grown = [&](double by) {
    std::vector<Ball> larger = balls;
    for (Ball& ball : larger) ball.radius += by;
    return BallUnion(larger, 1);
  };
  double area = 0;
  for (const double part : grown(0).exposure().areas) area += part;
  const double step = 1e-3,
               slope =
                   (grown(step).exposure().volume - grown(-step).exposure().volume) / (2 * step);
  EXPECT_NEAR(slope / area, 1, measured(1e-6));
}

TEST(BallUnion, TakesDegenerateBalls) {
  // Equal balls, a ball inside another one, balls that touch, and a lattice with corners of four
  // balls.
  EXPECT_NEAR(BallUnion({{V3d(1), 1}, {V3d(1), 1}}, 1).exposure().volume, 4 * kPi / 3, 1e-14);
  const BallUnion nested({{V3d(0), 2}, {V3d(0.5, 0, 0), 1}, {V3d(1, 0, 0), 1}}, 3);
  EXPECT_NEAR(nested.exposure().volume, 32 * kPi / 3, 1e-13);
  EXPECT_EQ(nested.exposure().areas[1], 0);
  EXPECT_EQ(nested.exposure().areas[2], 0);
  const BallUnion touching({{V3d(0), 1}, {V3d(2, 0, 0), 1}}, 3);
  EXPECT_NEAR(touching.exposure().volume, 8 * kPi / 3, 1e-14);
  EXPECT_NEAR(touching.distance(V3d(1, 0, 0)), 0, 1e-15);

  std::vector<Ball> lattice;
  for (int n = 0; n < 27; ++n) lattice.push_back({latticePoint(n, 3), 0.75});
  const BallUnion all(lattice, 2);
  double worst = 0;
  for (int n = 0; n < 1000; ++n) {
    const V3d p = latticePoint(n, 10) * 0.25;
    const double truth = distanceByAll(lattice, p);
    worst = std::max(worst, std::abs(all.distance(p) - std::max(truth, -2.0)));
  }
  EXPECT_LT(worst, 1e-13);
  for (std::size_t n = 0; n < lattice.size(); ++n)
    EXPECT_NEAR(all.exposure().areas[n], areaByLatitudes(lattice, n), measured(2e-4));
}

TEST(BallUnion, TakesBallsOfVeryDifferentSizes) {
  std::vector<Ball> balls = randomBalls(8, 10, 4);
  balls.push_back({V3d(0, 0, -1004), 1000});
  balls.push_back({V3d(3, 3, 3), 1e-3});
  balls.push_back({V3d(50, 0, 0), 0.01});
  const BallUnion all(balls, 3);
  std::mt19937 random(9);
  std::uniform_real_distribution<double> place(-8, 8);
  double worst = 0;
  for (int n = 0; n < 1000; ++n) {
    const V3d p(place(random), place(random), place(random));
    const double truth = distanceByAll(balls, p);
    if (truth > -3) worst = std::max(worst, std::abs(all.distance(p) - truth));
  }
  EXPECT_LT(worst, 1e-12);
}

TEST(BallUnion, HoldsClustersFarApartInLittleMemory) {
  std::vector<Ball> balls = randomBalls(11, 200, 10);
  const std::size_t alone = BallUnion(balls, 3).bytes();
  const std::vector<Ball> others = randomBalls(12, 200, 10, V3d(1e5, 2e5, -1e5));
  balls.insert(balls.end(), others.begin(), others.end());
  const BallUnion all(balls, 3);
  EXPECT_LT(all.bytes(), 4 * alone);
  for (const V3d& p : {V3d(5e4, 0, 0), V3d(1e5, 2e5, -1e5) + V3d(30, 0, 0), V3d(1e7, 1e7, 0)}) {
    const double truth = distanceByAll(balls, p);
    EXPECT_NEAR(all.distance(p) / truth, 1, 1e-12);
  }
}

TEST(BallUnion, TakesManyBallsInOnePlace) {
  std::vector<Ball> balls(100'000, Ball{V3d(1, 2, 3), 1});
  balls.push_back({V3d(1, 2, 3), 2});
  const BallUnion all(balls, 1);
  EXPECT_NEAR(all.exposure().volume, 32 * kPi / 3, 1e-12);
  EXPECT_NEAR(all.distance(V3d(1, 2, 8)), 3, 1e-14);
}

TEST(BallUnion, KeepsBallsThatTouchWithinRounding) {
  int overlaps = 0;
  for (int n = 0; n < 2000; ++n) {
    const double a = 1.2 + 0.001 * n, b = 1.7, apart = std::nextafter(a + b, 0);
    const V3d axis = V3d(std::cos(n), std::sin(n), 0.3).normalized();
    const BallUnion both({{V3d(0), a}, {axis * apart, b}}, 1);
    overlaps += (axis * apart).length() < a + b;
    EXPECT_NEAR(both.exposure().areas[0] / (4 * kPi * a * a), 1, 1e-6);
    EXPECT_NEAR(both.exposure().areas[1] / (4 * kPi * b * b), 1, 1e-6);
  }
  EXPECT_GT(overlaps, 500);
}

TEST(BallUnion, CanBeCancelled) {
  const std::vector<Ball> balls = randomBalls(13, 500, 15);
  for (const double at : {0.05, 0.3, 0.6})
    EXPECT_FALSE(refusal<levelset::Cancelled>([&] {
                   BallUnion(balls, 3, levelset::kNoMemoryLimit,
                             [&](double share) { return share < at; });
                 }).empty());
}

TEST(BallUnion, HasTheSameBitsOnAnyNumberOfThreads) {
  const std::vector<Ball> balls = randomBalls(10, 300, 20);
  const auto figures = [&] {
    const BallUnion all(balls, 3);
    std::vector<double> values = all.exposure().areas;
    values.push_back(all.exposure().volume);
    for (int n = 0; n < 1000; ++n)
      values.push_back(all.distance(latticePoint(n, 10) * 4 - V3d(20)));
    return values;
  };
  EXPECT_EQ(support::onThreads(1, figures), support::onThreads(7, figures));
}

TEST(BallUnion, RefusesOtherBalls) {
  EXPECT_SAYS(refusal<InvalidInput>([] { BallUnion({}, 1); }), "no ball");
  EXPECT_SAYS(refusal<InvalidInput>([] { BallUnion({{V3d(0), 1}}, NAN); }), "depth");
  EXPECT_SAYS(refusal<InvalidInput>([] { BallUnion({{V3d(0), 0}}, 1); }), "ball 0");
  EXPECT_SAYS(refusal<InvalidInput>([] {
                BallUnion({{V3d(0), 1}, {V3d(0, NAN, 0), 1}}, 1);
              }),
              "ball 1");
  EXPECT_FALSE(
      refusal<levelset::ResourceLimit>([] { BallUnion(randomBalls(1, 500, 3), 1, 1000); }).empty());
}

}  // namespace ball_union_test
