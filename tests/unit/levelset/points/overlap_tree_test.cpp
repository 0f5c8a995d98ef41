// Compares searches in the tree with overlapping siblings with linear searches.

#include "levelset/points/search/overlap_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "levelset/points/search/point_search.h"
#include "levelset/points/search/triangle_search.h"
#include "tests/support/threads.h"

namespace overlap_tree_test {

using Imath::V3d;
using levelset::points::Found;
using levelset::points::makePointSearch;
using levelset::points::makeTriangleSearch;
using levelset::points::PointSearch;
using levelset::points::TriangleSearch;
using Random = std::mt19937;

constexpr double kAny = std::numeric_limits<double>::infinity();

V3d pointIn(Random& random, double r) {
  std::uniform_real_distribution<double> in(-r, r);
  const double x = in(random), y = in(random);
  return {x, y, in(random)};
}

V3d rounded(const V3d& p) {
  return {std::round(p.x), std::round(p.y), std::round(p.z)};
}

enum class Kind { Free, Plane, Line, Grid, OnePlace, Clusters };
constexpr int kKinds = 6;

std::vector<V3d> pointsOf(Random& random, Kind kind, const V3d& about, std::size_t count) {
  std::vector<V3d> points;
  for (std::size_t i = 0; i < count; ++i) {
    V3d p = pointIn(random, 10);
    if (kind == Kind::Plane) p.y = 3;
    if (kind == Kind::Line) p = V3d(p.x, 2, 3);
    if (kind == Kind::Grid) p = rounded(p);
    if (kind == Kind::OnePlace) p = V3d(1, 2, 3);
    if (kind == Kind::Clusters) p = i % 3 ? V3d(static_cast<double>(i % 2)) : p * 1e-9;
    points.push_back(about + p);
  }
  return points;
}

std::vector<Found> sortedByDistance(const std::vector<V3d>& points, const V3d& from) {
  std::vector<Found> all;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const V3d d = points[i] - from;
    all.push_back({d.x * d.x + d.y * d.y + d.z * d.z, static_cast<std::uint32_t>(i)});
  }
  std::sort(all.begin(), all.end());
  return all;
}

void expectEqual(const std::vector<Found>& found, const std::vector<Found>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].index, expected[i].index) << i;
    EXPECT_EQ(found[i].squared, expected[i].squared) << i;
  }
}

TEST(OverlapTree, FindsWhatALinearSearchFinds) {
  Random random(1);
  for (int round = 0; round < 120; ++round) {
    const V3d about = round % 5 == 0 ? V3d(1e6, -2e6, 3e5) : V3d(0);
    const std::vector<V3d> points =
        pointsOf(random, static_cast<Kind>(round % kKinds), about, 1 + random() % 400);
    const PointSearch tree = makePointSearch(points);
    std::vector<Found> found;
    for (int i = 0; i < 20; ++i) {
      V3d query = about + pointIn(random, i % 5 == 0 ? 1e3 : 12);
      if (i % 2) query = rounded(query);
      std::vector<Found> all = sortedByDistance(points, query);
      EXPECT_EQ(tree.closest(query, kAny).index, all[0].index);
      EXPECT_EQ(tree.closest(query, all[0].squared).isValid(), false);
      const std::size_t count = 1 + random() % 40;
      tree.closest(query, count, found);
      expectEqual(found, {all.begin(),
                          all.begin() + static_cast<std::ptrdiff_t>(std::min(count, all.size()))});
      const double squaredRadius = all[all.size() / 3].squared;
      tree.within(query, squaredRadius, found);
      std::erase_if(all, [&](const Found& f) { return f.squared > squaredRadius; });
      std::sort(all.begin(), all.end(),
                [](const Found& a, const Found& b) { return a.index < b.index; });
      expectEqual(found, all);
    }
  }
}

TEST(OverlapTree, FindsTheClosestTriangle) {
  Random random(2);
  for (int round = 0; round < 80; ++round) {
    levelset::TriMesh mesh;
    const std::size_t count = 1 + random() % 300;
    for (std::uint32_t i = 0; i < count; ++i) {
      // Small triangles, long ones, and copies of one.
      const V3d at = round % 4 == 3 ? V3d(1, 2, 3) : pointIn(random, 10);
      const double size = round % 4 == 1 && i % 10 == 0 ? 20 : 1;
      mesh.positions.push_back(at);
      mesh.positions.push_back(round % 4 == 3 ? V3d(2, 2, 3) : at + pointIn(random, size));
      mesh.positions.push_back(round % 4 == 3 ? V3d(2, 4, 3) : at + pointIn(random, 1));
      mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    const TriangleSearch tree = makeTriangleSearch(mesh);
    for (int i = 0; i < 30; ++i) {
      const V3d query = pointIn(random, 25);
      Found best;
      for (std::uint32_t t = 0; t < count; ++t) {
        const levelset::points::TriangleItem item{
            {mesh.positions[3 * t], mesh.positions[3 * t + 1], mesh.positions[3 * t + 2]}, t};
        best = std::min(best, Found{item.squaredDistance(query), t});
      }
      const Found found = tree.closest(query, kAny);
      EXPECT_EQ(found.index, best.index);
      EXPECT_EQ(found.squared, best.squared);
    }
  }
}

TEST(OverlapTree, IsEmptyWithoutItems) {
  const PointSearch tree = makePointSearch({});
  std::vector<Found> found(3);
  EXPECT_FALSE(tree.closest(V3d(0), kAny).isValid());
  tree.closest(V3d(0), 5, found);
  EXPECT_TRUE(found.empty());
  tree.within(V3d(0), 1, found);
  EXPECT_TRUE(found.empty());
  makePointSearch(std::vector<V3d>{V3d(1)}).closest(V3d(0), 0, found);
  EXPECT_TRUE(found.empty());
}

/// A tree that looked at each point of a place would need 10¹¹ steps here.
TEST(OverlapTree, SearchesAMillionPointsInOnePlace) {
  std::vector<V3d> points(1000000, V3d(0.1, 0.2, 0.3));
  points.push_back(V3d(1));
  const PointSearch tree = makePointSearch(points);
  std::vector<Found> found;
  for (int i = 0; i < 100000; ++i) {
    const V3d query(0.1, 0.2, 1e-6 * i);
    ASSERT_EQ(tree.closest(query, kAny).index, 0u);
    tree.closest(query, 3, found);
    ASSERT_EQ(found[2].index, 2u);
  }
  tree.within(V3d(0.1, 0.2, 0.3), 0, found);
  EXPECT_EQ(found.size(), 1000000u);
}

TEST(OverlapTree, HasTheSameOrderOnAnyNumberOfThreads) {
  Random random(3);
  std::vector<V3d> points = pointsOf(random, Kind::Free, V3d(0), 100000);
  const auto order = [&] {
    std::vector<std::uint32_t> numbers;
    const PointSearch tree = makePointSearch(points);
    for (const auto& item : tree.items()) numbers.push_back(item.index);
    return numbers;
  };
  const auto one = support::onThreads(1, order);
  EXPECT_EQ(one, support::onThreads(3, order));
  EXPECT_EQ(one, support::onThreads(8, order));
}

}  // namespace overlap_tree_test
