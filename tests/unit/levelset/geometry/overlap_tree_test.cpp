// Compares searches in the tree with overlapping siblings with linear searches.

#include "levelset/geometry/search/overlap_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "levelset/geometry/search/point_search.h"
#include "levelset/geometry/search/triangle_search.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace overlap_tree_test {

using Imath::V3d;
using levelset::FoundItem;
using levelset::makePointSearch;
using levelset::makeTriangleSearch;
using levelset::PointSearch;
using levelset::TriangleItem;
using levelset::TriangleSearch;
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

std::vector<FoundItem> sortedByDistance(const std::vector<V3d>& points, const V3d& from) {
  std::vector<FoundItem> all;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const V3d d = points[i] - from;
    all.push_back({d.x * d.x + d.y * d.y + d.z * d.z, static_cast<std::uint32_t>(i)});
  }
  std::sort(all.begin(), all.end());
  return all;
}

void expectEqual(const std::vector<FoundItem>& found, const std::vector<FoundItem>& expected) {
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
    std::vector<FoundItem> found;
    for (int i = 0; i < 20; ++i) {
      V3d query = about + pointIn(random, i % 5 == 0 ? 1e3 : 12);
      if (i % 2) query = rounded(query);
      std::vector<FoundItem> all = sortedByDistance(points, query);
      EXPECT_EQ(tree.closest(query, kAny).index, all[0].index);
      EXPECT_EQ(tree.closest(query, all[0].squared).isValid(), false);
      const std::size_t count = 1 + random() % 40;
      tree.closest(query, count, found);
      expectEqual(found, {all.begin(),
                          all.begin() + static_cast<std::ptrdiff_t>(std::min(count, all.size()))});
      const double squaredRadius = all[all.size() / 3].squared;
      tree.within(query, squaredRadius, found);
      std::erase_if(all, [&](const FoundItem& f) { return f.squared > squaredRadius; });
      std::sort(all.begin(), all.end(),
                [](const FoundItem& a, const FoundItem& b) { return a.index < b.index; });
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
      FoundItem best;
      for (std::uint32_t t = 0; t < count; ++t) {
        const TriangleItem item{
            {mesh.positions[3 * t], mesh.positions[3 * t + 1], mesh.positions[3 * t + 2]}, t};
        best = std::min(best, FoundItem{item.squaredDistance(query), t});
      }
      const FoundItem found = tree.closest(query, kAny);
      EXPECT_EQ(found.index, best.index);
      EXPECT_EQ(found.squared, best.squared);
    }
  }
}

constexpr double kAway = 1e6;

/// Queries on the items, beside them, and far from them.
V3d queryAbout(Random& random, const V3d& item, int i) {
  constexpr double kReach[] = {0, 1e-3, 3, 40, 1e5};
  return item + pointIn(random, kReach[i % 5]);
}

TEST(OverlapTree, FindsTheClosestPointFarFromTheOrigin) {
  Random random(4);
  for (int kind = 0; kind < kKinds; ++kind) {
    const std::vector<V3d> points =
        pointsOf(random, static_cast<Kind>(kind), V3d(kAway, -2 * kAway, kAway / 3), 600);
    const PointSearch tree = makePointSearch(points);
    for (int i = 0; i < 10000; ++i) {
      const V3d query = queryAbout(random, points[random() % points.size()], i);
      FoundItem best;
      for (std::uint32_t n = 0; n < points.size(); ++n)
        best =
            std::min(best, FoundItem{levelset::PointItem{points[n], n}.squaredDistance(query), n});
      const FoundItem found = tree.closest(query, kAny);
      ASSERT_EQ(found.index, best.index) << kind;
      ASSERT_EQ(found.squared, best.squared) << kind;
    }
  }
}

/// Some triangles have no area, some no length, some are copies of others.
std::vector<TriangleItem> trianglesAbout(Random& random, const V3d& about) {
  std::vector<TriangleItem> items;
  for (std::uint32_t i = 0; i < 300; ++i) {
    const V3d at = about + pointIn(random, 10), u = pointIn(random, i % 10 ? 1 : 20);
    TriangleItem item{{at, at + u, at + pointIn(random, 1)}, i};
    if (i % 7 == 1) item.corners[2] = at + u * 0.5;
    if (i % 7 == 2) item.corners[1] = item.corners[2] = at;
    if (i % 7 == 3 && i > 10) item.corners = items[i - 10].corners;
    items.push_back(item);
  }
  return items;
}

TEST(OverlapTree, FindsTheClosestTriangleFarFromTheOrigin) {
  Random random(5);
  for (const double away : {0.0, 1.0}) {
    const std::vector<TriangleItem> items =
        trianglesAbout(random, V3d(kAway, -2 * kAway, kAway / 3) * away);
    const TriangleSearch tree((std::vector<TriangleItem>(items)));
    for (int i = 0; i < 10000; ++i) {
      const TriangleItem& near = items[random() % items.size()];
      const V3d query = queryAbout(random, near.corners[random() % 3], i);
      FoundItem best;
      for (const TriangleItem& item : items)
        best = std::min(best, FoundItem{item.squaredDistance(query), item.index});
      const auto [found, item] = tree.closestItem(query, kAny);
      ASSERT_TRUE(item);
      ASSERT_EQ(item->index, found.index);
      ASSERT_EQ(found.index, best.index);
      ASSERT_EQ(found.squared, best.squared);
      ASSERT_FALSE(tree.closest(query, best.squared).isValid());
    }
  }
}

/// Box in single precision with its number.
struct FloatItem {
  using Number = float;
  static constexpr bool kHasExtent = true;
  levelset::ItemBox<float> bounds;
  std::uint32_t index;

  [[nodiscard]] const levelset::ItemBox<float>& box() const { return bounds; }
  [[nodiscard]] float centre(int axis) const { return bounds.centre(axis); }
  [[nodiscard]] bool isSameAs(const FloatItem&) const { return false; }
};

TEST(OverlapTree, VisitsAllBoxesWithinADistance) {
  Random random(6);
  for (const double away : {0.0, kAway}) {
    std::vector<FloatItem> items;
    for (std::uint32_t i = 0; i < 500; ++i) {
      const V3d low = V3d(away) + pointIn(random, 10), high = low + V3d(i % 3, 1, 1e-3);
      items.push_back({levelset::floatBox(low, high), i});
      for (int axis = 0; axis < 3; ++axis) {
        const auto first = static_cast<double>(items[i].bounds.low[axis]),
                   last = static_cast<double>(items[i].bounds.high[axis]);
        EXPECT_LE(first, low[axis]);
        EXPECT_GE(last, high[axis]);
        EXPECT_LT(low[axis] - first, support::rounding(1) * (away + 13));
        EXPECT_LT(last - high[axis], support::rounding(1) * (away + 13));
      }
    }
    const levelset::OverlapTree<FloatItem> tree((std::vector<FloatItem>(items)));
    for (int i = 0; i < 1000; ++i) {
      const V3d query = V3d(away) + pointIn(random, i % 2 ? 12 : 100);
      const double squared = static_cast<double>(random() % 40);
      std::vector<bool> expected, visited(items.size());
      for (const FloatItem& item : items)
        expected.push_back(item.bounds.squaredDistance(query) <= squared);
      tree.visit(query, squared, [&](const FloatItem& item) { visited[item.index] = true; });
      ASSERT_EQ(visited, expected) << i;
    }
  }
}

/// Splitting planes alone would visit all points of a flat surface whose distance equals its width.
TEST(OverlapTree, VisitsFewPointsOfAFarFlatSurface) {
  constexpr int kSide = 200;
  std::vector<V3d> points;
  for (int x = 0; x < kSide; ++x)
    for (int y = 0; y < kSide; ++y) points.emplace_back(x, y, 0);
  const PointSearch tree = makePointSearch(points);
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    const V3d query = V3d(kSide / 2.0, kSide / 2.0, 100) + pointIn(random, 90);
    double squared = kAny;
    std::size_t looked = 0;
    tree.visit(query, squared, [&](const levelset::PointItem& item) {
      squared = std::min(squared, item.squaredDistance(query));
      ++looked;
    });
    EXPECT_LT(static_cast<double>(looked), support::measured(6)) << i;
    EXPECT_LT(std::abs(std::sqrt(squared) - query.z), support::measured(0.0132));
  }
}

TEST(OverlapTree, FindsNothingAtTheLimitItself) {
  const std::vector<V3d> points = {V3d(0), V3d(5, 0, 0), V3d(-5, 0, 0)};
  const PointSearch tree = makePointSearch(points);
  EXPECT_FALSE(tree.closest(V3d(0, 3, 0), 9).isValid());
  EXPECT_EQ(tree.closest(V3d(0, 3, 0), std::nextafter(9.0, 10.0)).index, 0u);
  EXPECT_FALSE(isNear(tree, V3d(0, 3, 0), 3));
  EXPECT_TRUE(isNear(tree, V3d(0, 3, 0), 3.001));
}

TEST(OverlapTree, HoldsOneTriangle) {
  levelset::TriMesh mesh;
  mesh.positions = {V3d(0), V3d(2, 0, 0), V3d(0, 2, 0)};
  mesh.triangles = {{0, 1, 2}};
  const TriangleSearch tree = makeTriangleSearch(mesh);
  const auto [found, item] = tree.closestItem(V3d(0.5, 0.25, 3), kAny);
  ASSERT_TRUE(item);
  EXPECT_EQ(found.squared, 9);
  EXPECT_EQ(item->closestPoint(V3d(0.5, 0.25, 3)), V3d(0.5, 0.25, 0));
  EXPECT_FALSE(tree.closestItem(V3d(0.5, 0.25, 3), 9).second);
  EXPECT_FALSE(makeTriangleSearch({}).closestItem(V3d(0), kAny).second);
}

TEST(OverlapTree, IsEmptyWithoutItems) {
  const PointSearch tree = makePointSearch(std::vector<V3d>{});
  std::vector<FoundItem> found(3);
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
  std::vector<FoundItem> found;
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
  const auto triangleOrder = [&] {
    std::vector<TriangleItem> items;
    for (std::uint32_t i = 0; i + 2 < points.size(); i += 3)
      items.push_back({{points[i], points[i + 1], points[i + 2]}, i / 3});
    std::vector<std::uint32_t> numbers;
    const TriangleSearch tree(std::move(items));
    for (const auto& item : tree.items()) numbers.push_back(item.index);
    return numbers;
  };
  const auto oneThread = support::onThreads(1, triangleOrder);
  EXPECT_EQ(oneThread, support::onThreads(3, triangleOrder));
}

}  // namespace overlap_tree_test
