#include "mapping/surface/geodesic.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "levelset/shapes/shapes.h"
#include "mapping/surface/surface_projection.h"
#include "mapping/surface/surface_walk.h"
#include "tests/support/measured.h"
#include "tests/support/patches.h"

namespace geodesic_test {

using Imath::V3d;
using levelset::NarrowBand;
using mapping::geodesic;
using mapping::pathLength;
using mapping::SurfaceField;

constexpr double kPi = std::numbers::pi;

/// Length / exact − 1 between two points near the surface. Expects every point of the path on the
/// surface.
double excess(const NarrowBand& band, V3d a, V3d b, double exact) {
  const SurfaceField field(band);
  EXPECT_TRUE(field.project(a, 0) && field.project(b, 0));
  const std::vector<V3d> path = geodesic(field, 0, a, b);
  if (path.size() < 2) return HUGE_VAL;
  EXPECT_EQ(path.front(), a);
  EXPECT_EQ(path.back(), b);
  for (const V3d& p : path)
    EXPECT_LT(std::abs(field.value(p)), support::measured(9.99e-6) * band.voxelSize());
  return pathLength(path) / exact - 1;
}

TEST(Geodesic, IsAGreatCircleOnASphere) {
  std::vector<double> worst;
  for (const double voxel : {0.1, 0.05}) {
    const NarrowBand ball = support::makeBall(1, voxel);
    worst.push_back(0);
    for (const double angle : {0.3, 1.5, 2.5, 3.1}) {
      const V3d end(std::cos(angle), 0.6 * std::sin(angle), 0.8 * std::sin(angle));
      worst.back() = std::max(worst.back(), std::abs(excess(ball, V3d(1, 0, 0), end, angle)));
    }
  }
  EXPECT_LT(worst[0], support::measured(0.000394));
  EXPECT_LT(worst[1], support::measured(0.233) * worst[0]);  // chords are second-order accurate
}

TEST(Geodesic, IsEmptyIfItIsLongerThanTheLimit) {
  const NarrowBand ball = support::makeBall(1, 0.05);
  const SurfaceField field(ball);
  V3d a(1, 0, 0), b(std::cos(2.5), std::sin(2.5), 0);
  ASSERT_TRUE(field.project(a, 0) && field.project(b, 0));
  EXPECT_TRUE(geodesic(field, 0, a, b, 2.2).empty());
  EXPECT_NEAR(pathLength(geodesic(field, 0, a, b, 3)), 2.5, support::measured(7.05e-5));
}

TEST(Geodesic, IsTheShorterHelixOnACylinder) {
  const NarrowBand pipe = support::sampleBand([](const V3d& p) { return std::hypot(p.x, p.y) - 1; },
                                              {V3d(-1, -1, -3), V3d(1, 1, 3)}, 0.1);
  for (const double turn : {0.3, 0.45, 0.49, 0.51, 0.55})
    for (const double rise : {0.0, 1.0, 4.0}) {
      const double angle = 2 * kPi * turn, shorter = 2 * kPi * std::min(turn, 1 - turn);
      const V3d end(std::cos(angle), std::sin(angle), rise - 2);
      const double off = excess(pipe, V3d(1, 0, -2), end, std::hypot(shorter, rise));
      EXPECT_LT(std::abs(off), support::measured(0.000385))
          << turn << " of a turn, " << rise << " up";
    }
}

TEST(Geodesic, PassesAConesApexOnOneSide) {
  // The unrolled cone is a sector, and the path is straight.
  for (const double half : {0.3, 0.6}) {
    const double s = std::sin(half), c = std::cos(half);
    const NarrowBand cone = support::sampleBand(
        [=](const V3d& p) {
          const double r = std::hypot(p.x, p.y);
          return r * s < p.z * c ? std::hypot(r, p.z) : r * c + p.z * s;
        },
        {V3d(-2, -2, -2.5), V3d(2, 2, 0.2)}, 0.1);
    for (const double around : {1.0, 2.0, 3.0})
      for (const double far : {1.0, 2.0}) {
        const V3d a = V3d(s, 0, -c) * 1.5,
                  b = V3d(s * std::cos(around), s * std::sin(around), -c) * far;
        const double exact = std::sqrt(1.5 * 1.5 + far * far - 3 * far * std::cos(around * s));
        EXPECT_LT(std::abs(excess(cone, a, b, exact)), support::measured(0.000688))
            << half << " " << around;
      }
  }
}

TEST(Geodesic, SolvesTheSpiderProblemOnABox) {
  // Dudeney's spider and fly: the path over five faces is 40 feet, the path straight down and along
  // is 42.
  const NarrowBand room = levelset::makeBox(V3d(30, 12, 12), V3d(0), 0.5);
  EXPECT_LT(std::abs(excess(room, V3d(-15, 0, 5), V3d(15, 0, -5), 40)), support::measured(0.00415));
}

TEST(Geodesic, UnfoldsTheEdgesOfABox) {
  const NarrowBand box = levelset::makeBox(V3d(30, 12, 12), V3d(0), 0.25);
  EXPECT_LT(std::abs(excess(box, V3d(-3, -2, 6), V3d(9, -6, 3), std::hypot(12, 4 + 3))),
            support::measured(6.24e-4));
  EXPECT_LT(std::abs(excess(box, V3d(13, -4, 6), V3d(15, 1, -2), std::hypot(2 + 8, 5))),
            support::measured(0.00275));
  // Straight over, and around to the face below.
  EXPECT_LT(std::abs(excess(box, V3d(1, 2, 6), V3d(1, 2, -6), 4 + 12 + 4)),
            support::measured(0.00162));
}

TEST(Geodesic, UnfoldsARidgeAndATrough) {
  const double h = std::sqrt(0.5);
  for (const double up : {1.0, -1.0}) {
    const NarrowBand fold = support::sampleBand(
        [=](const V3d& p) {
          const double one = (p.x + p.z) * h, other = (p.z - p.x) * h;
          return up > 0 ? std::max(one, other) : std::min(one, other);
        },
        {V3d(-2), V3d(2)}, 0.1);
    for (const double along : {0.0, 0.5, 1.5}) {
      const double exact = std::hypot(2, 2 * along);
      EXPECT_LT(std::abs(excess(fold, V3d(-h, -along, -h * up), V3d(h, along, -h * up), exact)),
                support::measured(0.00376))
          << up << " " << along;
    }
  }
}

TEST(Geodesic, FollowsATorusInsideOutsideAndThrough) {
  const NarrowBand torus = levelset::makeTorus(2, 0.7, V3d(0), V3d(0, 0, 1), 0.1);
  const auto at = [](double radius, double angle) {
    return V3d(radius * std::cos(angle), radius * std::sin(angle), 0);
  };
  EXPECT_LT(std::abs(excess(torus, at(2.7, 0), at(2.7, 0.7), 2.7 * 0.7)),
            support::measured(1.99e-5));
  // Saddle points everywhere: the inner equator is the shortest path up to its conjugate point.
  for (const double angle : {1.0, 3.0})
    EXPECT_LT(std::abs(excess(torus, at(1.3, 0), at(1.3, angle), 1.3 * angle)),
              support::measured(0.000163));
  EXPECT_LT(std::abs(excess(torus, at(1.3, 0), at(1.3, 3.3), 1.3 * (2 * kPi - 3.3))),
            support::measured(7.09e-5));
  // Over the tube: half a meridian.
  EXPECT_LT(std::abs(excess(torus, at(2.7, 0), at(1.3, 0), 0.7 * kPi)), support::measured(0.0004));
}

TEST(Geodesic, FollowsASaddlesParabolas) {
  const NarrowBand saddle = support::sampleBand(
      [](const V3d& p) {
        return (p.z - p.x * p.x + p.y * p.y) / std::sqrt(1 + 4 * p.x * p.x + 4 * p.y * p.y);
      },
      {V3d(-1.5, -1.5, -2.5), V3d(1.5, 1.5, 2.5)}, 0.1, 4);
  const double arc = 0.5 * std::sqrt(5.0) + std::asinh(2.0) / 4;
  EXPECT_LT(std::abs(excess(saddle, V3d(-1, 0, 1), V3d(1, 0, 1), 2 * arc)),
            support::measured(0.000327));
  EXPECT_LT(std::abs(excess(saddle, V3d(0, -1, -1), V3d(0, 1, -1), 2 * arc)),
            support::measured(0.000327));
  // The straight lines in a saddle.
  EXPECT_LT(std::abs(excess(saddle, V3d(-1, -1, 0), V3d(1, 1, 0), std::sqrt(8.0))),
            support::doubleRounding(1));
}

TEST(Geodesic, GoesAroundAThinEarAndNotThroughIt) {
  // Two points above each other on a plate of 2.5 to 6 voxels with round edges.
  for (const double thickness : {6.0, 3.0, 2.5}) {
    const double voxel = 0.05, half = thickness * voxel / 2;
    const NarrowBand ear = support::sampleBand(
        [=](const V3d& p) {
          const V3d out(std::max(0.0, std::abs(p.x) - 1), std::max(0.0, std::abs(p.y) - 1), p.z);
          return out.length() - half;
        },
        {V3d(-1.2, -1.2, -0.2), V3d(1.2, 1.2, 0.2)}, voxel);
    EXPECT_LT(std::abs(excess(ear, V3d(0.5, 0, half), V3d(0.5, 0.1, -half),
                              std::hypot(1 + kPi * half, 0.1))),
              support::measured(0.00197))
        << thickness;
    // Three edges are at almost the same distance.
    EXPECT_LT(std::abs(excess(ear, V3d(0.1, 0.05, half), V3d(0.1, 0.05, -half), 1.8 + kPi * half)),
              support::measured(0.00114))
        << thickness;
  }
}

TEST(Geodesic, IsTheSameFromEitherEnd) {
  const NarrowBand torus =
      levelset::makeTorus(2, 0.7, V3d(0.3, 0, 0), V3d(1, 2, 3).normalized(), 0.1);
  const SurfaceField field(torus);
  const V3d a = mapping::closestSurfacePoint(torus, V3d(2, 1, -1)),
            b = mapping::closestSurfacePoint(torus, V3d(-2, 0.5, 1));
  const double there = pathLength(geodesic(field, 0, a, b)),
               back = pathLength(geodesic(field, 0, b, a));
  EXPECT_NEAR(there, back, support::rounding(0.25) * there);
}

TEST(Geodesic, IsEmptyBetweenSeparateComponents) {
  const NarrowBand two = support::sampleBand(
      [](const V3d& p) {
        return std::min((p - V3d(-0.8, 0, 0)).length(), (p - V3d(0.8, 0, 0)).length()) - 0.5;
      },
      {V3d(-1.3, -0.5, -0.5), V3d(1.3, 0.5, 0.5)}, 0.1);
  EXPECT_TRUE(geodesic(SurfaceField(two), 0, V3d(-0.8, 0, 0.5), V3d(0.8, 0, 0.5)).empty());
}

TEST(Geodesic, GuidedByAnotherStaysOnItsSide) {
  // Half a turn has two shortest paths. The requested one is used, on another layer too.
  const NarrowBand pipe = support::sampleBand([](const V3d& p) { return std::hypot(p.x, p.y) - 1; },
                                              {V3d(-1, -1, -1), V3d(1, 1, 1)}, 0.1, 6);
  const SurfaceField field(pipe);
  for (const double side : {1.0, -1.0}) {
    std::vector<V3d> half;
    for (int i = 0; i <= 20; ++i)
      half.emplace_back(std::cos(kPi * i / 20), side * std::sin(kPi * i / 20), 0);
    const std::vector<V3d> above =
        mapping::geodesicLike(field, 0.3, V3d(1.3, 0, 0.2), V3d(-1.3, 0, 0.2), half);
    ASSERT_FALSE(above.empty());
    EXPECT_GT(side * above[above.size() / 2].y, 1.29);
    EXPECT_NEAR(pathLength(above), 1.3 * kPi, support::measured(0.00105));
  }
}

TEST(SurfaceWalk, ReturnsAroundASphere) {
  const NarrowBand ball = support::makeBall(1, 0.1);
  const SurfaceField field(ball);
  const V3d start = V3d(1, 2, 2) / 3.0;
  mapping::SurfaceWalk walk(field, 0, start, V3d(2, -1, 3));
  const V3d direction = walk.direction();
  ASSERT_TRUE(walk.advance(2 * kPi));
  EXPECT_LT((walk.position() - start).length(), support::measured(8.78e-5));
  EXPECT_LT((walk.direction() - direction).length(), support::measured(1.16e-4));
  EXPECT_NEAR(walk.walked(), 2 * kPi, support::doubleRounding(125));
}

TEST(SurfaceWalk, KeepsItsAngleAtAnEdge) {
  const NarrowBand box = levelset::makeBox(V3d(30, 30, 12), V3d(0), 0.25);
  const SurfaceField field(box);
  for (const double angle : {0.2, 0.7, 1.2}) {
    // From 4 before the edge at x = 15, to the same distance beyond it.
    const V3d way(std::cos(angle), std::sin(angle), 0);
    mapping::SurfaceWalk walk(field, 0, V3d(11, -6, 6), way);
    ASSERT_TRUE(walk.advance(8 / way.x));
    const V3d exact(15, -6 + 8 * way.y / way.x, 2);
    EXPECT_LT((walk.position() - exact).length(), support::measured(0.0751) * 0.25) << angle;
    EXPECT_LT((walk.direction() - V3d(0, way.y, -way.x)).length(), support::rounding(0.4)) << angle;
  }
}

TEST(SurfaceWalk, StaysWithoutADirection) {
  const NarrowBand ball = support::makeBall(1, 0.1);
  const SurfaceField field(ball);
  mapping::SurfaceWalk walk(field, 0, V3d(0, 0, 1), V3d(0, 0, 5));
  EXPECT_TRUE(walk.advance(0));
  EXPECT_FALSE(walk.advance(0.5));
}

}  // namespace geodesic_test
