#include "levelset/points/field/cell_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace cell_points_test {

using Imath::V3d;
using Imath::V3f;
using levelset::FoundItem;
using levelset::PointCloud;
using levelset::points::CellPoints;
using levelset::points::orient;
using levelset::points::OrientedPoints;

/// Points of a ball of radius 1, and as many in a spot of it.
PointCloud ballWithSpot(std::size_t count) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  PointCloud cloud;
  for (std::size_t n = 0; n < 2 * count; ++n) {
    V3d p(normal(random), normal(random), normal(random));
    if (n % 2 == 1) p = V3d(0, 0, 1) + 0.003 * p;
    p.normalize();
    cloud.positions.push_back(p);
    cloud.normals.push_back(V3f(p));
  }
  return cloud;
}

/// The nearest point is the first one and the farthest the last; the others have any order.
void expectSame(std::vector<FoundItem> found, const std::vector<FoundItem>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  EXPECT_EQ(found.front().index, expected.front().index);
  EXPECT_EQ(found.back().index, expected.back().index);
  std::sort(found.begin(), found.end());
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].index, expected[i].index);
    EXPECT_EQ(found[i].squared, expected[i].squared);
  }
}

V3d inBall(std::mt19937& random) {
  std::uniform_real_distribution<double> coordinate(-1, 1);
  while (true) {
    const V3d arm(coordinate(random), coordinate(random), coordinate(random));
    if (arm.length() <= 1) return arm;
  }
}

/// Compares with the search at positions of balls in a ball.
void expectSearchResults(const OrientedPoints& points, const V3d& centre, double radius,
                         std::size_t count) {
  std::mt19937 random(3);
  CellPoints cell;
  std::vector<FoundItem> found, expected;
  points.search.closest(centre, count, expected);
  expectSame(cell.move(points, centre, radius, count), expected);
  for (int ball = 0; ball < 8; ++ball) {
    const V3d middle = centre + 2 * radius / 3 * inBall(random);
    points.search.closest(middle, count, expected);
    expectSame(cell.moveInside(middle, radius / 3), expected);
    for (int n = 0; n < 8; ++n) {
      const V3d at = middle + radius / 3 * inBall(random);
      cell.closest(at, found);
      points.search.closest(at, count, expected);
      expectSame(found, expected);
    }
  }
}

TEST(CellPoints, AreThoseOfTheSearch) {
  const OrientedPoints points = orient(ballWithSpot(4000));
  for (const std::size_t count : {std::size_t{1}, std::size_t{2}, std::size_t{17}})
    for (const double radius : {0.0, 0.01, 0.1})
      for (const V3d& centre : {V3d(1, 0, 0), V3d(0, 1.05, 0), V3d(0, 0, 1), V3d(0, 0.05, 0.99)})
        expectSearchResults(points, centre, radius, count);
}

TEST(CellPoints, OfASmallCloudAreAllOfThem) {
  const OrientedPoints points = orient(ballWithSpot(5));
  expectSearchResults(points, V3d(1, 0, 0), 0.1, 17);
}

TEST(CellPoints, AreOrderedByNumberAtOneDistance) {
  PointCloud cloud;
  for (int n = 0; n < 24; ++n) {
    cloud.positions.emplace_back(std::cos(n * M_PI / 12), std::sin(n * M_PI / 12), 0);
    cloud.normals.emplace_back(0, 0, 1);
  }
  // Permutations of the coordinates have the same distance from the diagonal, to the bit.
  for (const V3d& p : {V3d(1, 2, 3), V3d(2, 3, 1), V3d(3, 1, 2), V3d(3, 2, 1)}) {
    cloud.positions.push_back(p);
    cloud.normals.emplace_back(0, 0, 1);
  }
  const OrientedPoints points = orient(cloud);
  const V3d at = V3d(4) - points.centre;
  for (const std::size_t count : {1, 2, 3, 4, 9}) expectSearchResults(points, at, 0, count);
}

TEST(CellPoints, OfALatticeAreThoseBesideItsPoints) {
  PointCloud cloud;
  for (int x = 0; x < 6; ++x)
    for (int y = 0; y < 6; ++y)
      for (int z = 0; z < 2; ++z) {
        cloud.positions.push_back(0.1 * V3d(x, y, z));
        cloud.normals.emplace_back(0, 0, 1);
      }
  const OrientedPoints points = orient(cloud);
  CellPoints cell;
  std::vector<FoundItem> found, expected;
  for (const std::size_t count : {std::size_t{1}, std::size_t{2}, std::size_t{5}})
    for (const V3d& middle : points.positions) {
      cell.move(points, middle, 0.05, count);
      for (const double away : {0.0, 1e-16, 3e-16, 0.05}) {
        const V3d centre = middle + V3d(away, 0, 0);
        points.search.closest(centre, count, expected);
        expectSame(cell.moveInside(centre, 0.02), expected);
        const V3d at = centre + V3d(0, 2e-16, 0);
        cell.closest(at, found);
        points.search.closest(at, count, expected);
        expectSame(found, expected);
      }
    }
}

}  // namespace cell_points_test
