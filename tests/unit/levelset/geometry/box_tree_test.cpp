// Compares the nearest of many points and triangles with a linear search.

#include "levelset/geometry/box_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "levelset/geometry/closest_on_triangle.h"
#include "levelset/geometry/point_tree.h"
#include "levelset/geometry/triangle_tree.h"
#include "tests/support/measured.h"

namespace box_tree_test {

using levelset::TriangleTree;
using levelset::eikonal::PointTree;
using openvdb::Vec3d;
using Random = std::mt19937;

constexpr double kAnyDistance = std::numeric_limits<double>::max();

Vec3d pointIn(Random& random, double r) {
  std::uniform_real_distribution<double> in(-r, r);
  return {in(random), in(random), in(random)};
}

Vec3d rounded(const Vec3d& p) {
  return {std::round(p[0]), std::round(p[1]), std::round(p[2])};
}

/// Random clouds: some flat, some on a grid with many equal distances, some with many points at one
/// position.
std::vector<Vec3d> somePoints(Random& random, const Vec3d& about) {
  std::vector<Vec3d> points;
  const int count = 1 + static_cast<int>(random() % 300), kind = static_cast<int>(random() % 4);
  for (int i = 0; i < count; ++i) {
    Vec3d p = pointIn(random, 10);
    if (kind == 1) p[static_cast<int>(random() % 2)] = 3;
    if (kind == 2) p = rounded(p);
    if (kind == 3) p = Vec3d(1, 2, 3);
    points.push_back(about + p);
  }
  return points;
}

std::uint32_t nearestByAll(const std::vector<Vec3d>& points, const Vec3d& query, double limit) {
  double squared = limit * limit;
  std::uint32_t best = PointTree::kNone;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const double distance = (query - points[i]).lengthSqr();
    if (distance < squared) {
      squared = distance;
      best = i;
    }
  }
  return best;
}

TEST(PointTree, FindsTheFirstOfTheNearest) {
  Random random(1);
  for (int round = 0; round < 200; ++round) {
    const Vec3d about = round % 3 == 0 ? Vec3d(1e6, -2e6, 3e5) : Vec3d(0);
    const std::vector<Vec3d> points = somePoints(random, about);
    const PointTree tree(points);
    for (int i = 0; i < 50; ++i) {
      Vec3d query = about + pointIn(random, i % 5 == 0 ? 1e3 : 15);
      if (i % 2) query = rounded(query);
      const double limit = i % 3 ? kAnyDistance : std::round(query.length() / 10);
      ASSERT_EQ(tree.nearest(query, limit), nearestByAll(points, query, limit)) << round;
    }
  }
}

TEST(PointTree, FindsNothingAtTheLimitItself) {
  const std::vector<Vec3d> points = {Vec3d(0, 0, 0), Vec3d(5, 0, 0), Vec3d(-5, 0, 0)};
  const PointTree tree(points);
  EXPECT_EQ(tree.nearest(Vec3d(0, 3, 0), 3), PointTree::kNone);
  EXPECT_EQ(tree.nearest(Vec3d(0, 3, 0), std::nextafter(3, 4)), 0u);
  EXPECT_EQ(PointTree({}).nearest(Vec3d(0), kAnyDistance), PointTree::kNone);
}

TEST(TriangleTree, FindsTheNearestPoint) {
  Random random(2);
  for (int round = 0; round < 100; ++round) {
    std::vector<TriangleTree::Triangle> triangles;
    const int count = 1 + static_cast<int>(random() % 100);
    for (int i = 0; i < count; ++i) {
      const Vec3d at = pointIn(random, 10);
      triangles.push_back({at, at + pointIn(random, 1), at + pointIn(random, round % 2 ? 1 : 8)});
    }
    const TriangleTree tree(triangles);
    for (int i = 0; i < 30; ++i) {
      const Vec3d query = pointIn(random, 20);
      double best = kAnyDistance;
      for (const auto& [a, b, c] : triangles)
        best = std::min(best, (levelset::closestOnTriangle(query, a, b, c).point - query).length());
      const TriangleTree::Hit hit = tree.nearest(query, kAnyDistance);
      ASSERT_TRUE(hit.found);
      EXPECT_DOUBLE_EQ(hit.distance, best);
      EXPECT_DOUBLE_EQ((hit.point - query).length(), best);
      EXPECT_FALSE(tree.nearest(query, 0.999 * best).found);
    }
  }
}

/// Splitting planes alone would visit all points of a flat surface whose distance equals its width.
TEST(BoxTree, VisitsFewPointsOfAFarFlatSurface) {
  constexpr int kSide = 200;
  std::vector<Vec3d> points;
  for (int x = 0; x < kSide; ++x)
    for (int y = 0; y < kSide; ++y) points.emplace_back(x, y, 0);
  const levelset::BoxTree tree(
      points.size(),
      [&](std::uint32_t i, Vec3d& low, Vec3d& high) {
        low = openvdb::math::minComponent(low, points[i]);
        high = openvdb::math::maxComponent(high, points[i]);
      },
      [&](std::uint32_t i, int axis) { return points[i][axis]; });
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    const Vec3d query = Vec3d(kSide / 2.0, kSide / 2.0, 100) + pointIn(random, 90);
    double squared = kAnyDistance;
    std::size_t looked = 0;
    tree.search(query, squared, [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t k = begin; k < end; ++k, ++looked)
        squared = std::min(squared, (points[tree.order()[k]] - query).lengthSqr());
    });
    EXPECT_LT(looked, 100u) << i;
    EXPECT_LT(std::abs(std::sqrt(squared) - query[2]), support::measured(0.0132));
  }
}

}  // namespace box_tree_test
