#include "levelset/points/projection/cocone.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/unit/levelset/points/projection/projected_points.h"

namespace cocone_test {

using Imath::V3d;
using levelset::PointCloud;
using levelset::points::coconeGraph;
using levelset::points::CoconeGraph;

double meanDegree(const CoconeGraph& graph) {
  return static_cast<double>(graph.ends.size()) / static_cast<double>(graph.normals.size());
}

TEST(Cocone, ConnectsTheNeighboursOnASphere) {
  const PointCloud cloud = projected_points::sphere(2000);
  const CoconeGraph graph = coconeGraph(cloud.positions);
  // A triangulation of a sphere has 6 (1 − 2 / n) neighbours on average.
  EXPECT_NEAR(meanDegree(graph), 6 * (1 - 2.0 / 2000), 0.01);
  const double spacing = projected_points::hexagonalSpacing(4 * std::numbers::pi, 2000);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_GT(std::abs(graph.normals[i].dot(cloud.positions[i])), 1 - 1e-3);
    const auto neighbours = graph.neighbours(i);
    EXPECT_TRUE(std::is_sorted(neighbours.begin(), neighbours.end()));
    for (const std::uint32_t j : neighbours) {
      EXPECT_LT((cloud.positions[i] - cloud.positions[j]).length(), 2.2 * spacing);
      const auto back = graph.neighbours(j);
      EXPECT_TRUE(std::binary_search(back.begin(), back.end(), static_cast<std::uint32_t>(i)));
    }
  }
}

TEST(Cocone, KeepsTwoSheetsApart) {
  PointCloud cloud = projected_points::square(30);
  const std::size_t lower = cloud.size();
  for (std::size_t i = 0; i < lower; ++i)
    cloud.positions.push_back(cloud.positions[i] + V3d(0.01, 0.005, 3.0 / 30));
  const CoconeGraph graph = coconeGraph(cloud.positions);
  std::size_t across = 0;
  for (std::size_t i = 0; i < lower; ++i)
    for (const std::uint32_t j : graph.neighbours(i)) across += j >= lower;
  EXPECT_EQ(across, 0u);
}

TEST(Cocone, TriangulatesAPlane) {
  // Points inside a circle, and 60 points on it: all of them are corners of the convex hull.
  PointCloud cloud;
  for (const V3d& p : projected_points::square(20).positions)
    if ((p - V3d(0.5, 0.5, 0)).length() < 0.46) cloud.positions.push_back(p - V3d(0.5, 0.5, 0));
  for (int i = 0; i < 60; ++i)
    cloud.positions.emplace_back(0.5 * std::cos(i * std::numbers::pi / 30),
                                 0.5 * std::sin(i * std::numbers::pi / 30), 0);
  for (const double tilt : {0.0, 0.7}) {
    PointCloud turned = cloud;
    for (V3d& p : turned.positions)
      p = V3d(p.x, p.y * std::cos(tilt), p.y * std::sin(tilt)) + V3d(100 * tilt);
    const CoconeGraph graph = coconeGraph(turned.positions);
    // Edges of a triangulation of n points with b of them on the border: 3 n − 3 − b.
    EXPECT_EQ(graph.ends.size() / 2, 3 * cloud.size() - 3 - 60);
    for (const V3d& normal : graph.normals)
      EXPECT_NEAR(std::abs(normal.dot(V3d(0, -std::sin(tilt), std::cos(tilt)))), 1, 1e-12);
  }
}

}  // namespace cocone_test
