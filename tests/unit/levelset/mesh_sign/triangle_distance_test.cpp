#include "levelset/mesh_sign/triangle_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

namespace triangle_distance_test {

using Imath::V3d;
using levelset::convert::BlockDistance;
using levelset::convert::kBlockDim;
using levelset::convert::LocalMesh;
using levelset::convert::TriangleFrame;

/// Makes triangles with a corner near the block of 8³ grid points at the origin.
/// @param size    length of the first edge, voxels
/// @param height  height of the triangle over that edge, divided by the edge's length
LocalMesh triangles(std::size_t count, double size, double height) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-2, 9), direction(-1, 1);
  LocalMesh mesh;
  for (std::size_t i = 0; i < count; ++i) {
    const V3d a(place(random), place(random), place(random));
    const V3d along = V3d(direction(random), direction(random), direction(random)).normalized();
    const V3d other(direction(random), direction(random), direction(random));
    const V3d across = along.cross(other).normalized();
    const auto first = static_cast<std::uint32_t>(mesh.points.size());
    mesh.points.push_back(a);
    mesh.points.push_back(a + along * size);
    mesh.points.push_back(a + along * (size * (0.5 + direction(random))) +
                          across * (size * height));
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

/// Expects the distances of a block to be those to the nearest triangle, to the bit.
void expectNearest(const LocalMesh& mesh) {
  constexpr double kReach = 3;
  std::vector<std::uint32_t> all(mesh.triangles.size());
  std::iota(all.begin(), all.end(), 0u);
  BlockDistance block(kReach);
  EXPECT_TRUE(block.measure(mesh, all, V3d(0)));
  // The block measures relative to its centre.
  const V3d centre((kBlockDim - 1) / 2.0);
  std::vector<TriangleFrame> frames;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    frames.emplace_back(mesh.corner(t, 0) - centre, mesh.corner(t, 1) - centre,
                        mesh.corner(t, 2) - centre);
  for (int n = 0; n < 512; ++n) {
    const V3d point = V3d(n >> 6, n >> 3 & 7, n & 7) - centre;
    double squared = kReach * kReach;
    for (const TriangleFrame& frame : frames)
      squared = std::min(squared, frame.squaredDistance(point));
    ASSERT_EQ(block.distances()[static_cast<std::size_t>(n)], std::sqrt(squared)) << n;
  }
}

TEST(TriangleDistance, IsThatOfTheNearestTriangle) {
  for (const double size : {1e-9, 1e-3, 0.5, 2.0, 30.0, 2e3, 1e6})
    for (const double height : {0.0, 1e-9, 1e-4, 0.05, 0.8}) {
      SCOPED_TRACE(testing::Message() << "size " << size << ", height " << height);
      expectNearest(triangles(60, size, height));
    }
}

/// The nearest point often lies on an edge or a corner, where the distances of several triangles
/// differ by rounding only.
TEST(TriangleDistance, IsThatOfTheNearestOfAdjacentTriangles) {
  for (const double spacing : {0.3, 1.1, 4.0}) {
    LocalMesh mesh;
    constexpr std::uint32_t kSide = 40;
    const double middle = spacing * kSide / 2 - 3;
    for (std::uint32_t i = 0; i < kSide; ++i)
      for (std::uint32_t j = 0; j < kSide; ++j) {
        const double x = spacing * i - middle, y = spacing * j - middle;
        mesh.points.emplace_back(x, y, 3 + std::sin(1.3 * x) * std::cos(0.9 * y));
        if (i == 0 || j == 0) continue;
        const std::uint32_t at = i * kSide + j;
        mesh.triangles.push_back({at - kSide - 1, at - 1, at});
        mesh.triangles.push_back({at - kSide - 1, at, at - kSide});
      }
    SCOPED_TRACE(spacing);
    expectNearest(mesh);
  }
}

TEST(TriangleDistance, OfATriangleWithoutAreaIsThatOfItsLongestEdge) {
  LocalMesh mesh;
  mesh.points = {V3d(0, 3, 3), V3d(2, 3, 3), V3d(5, 3, 3),   // on a line
                 V3d(8, 2, 2), V3d(8, 4, 2), V3d(8, 3, 5)};  // nearest to the end of the block
  for (const levelset::convert::Triangle& triangle :
       {levelset::convert::Triangle{0, 1, 2}, levelset::convert::Triangle{0, 2, 1}}) {
    mesh.triangles = {triangle, {3, 4, 5}};
    expectNearest(mesh);
  }
}

TEST(TriangleDistance, OfATriangleWithoutExtentIsThatOfThePoint) {
  const V3d at(1, 2, -0.5);
  const TriangleFrame frame(at, at, at);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-4, 4);
  for (int n = 0; n < 100; ++n) {
    const V3d point(place(random), place(random), place(random));
    EXPECT_NEAR(std::sqrt(frame.squaredDistance(point)), (point - at).length(), 1e-14);
  }
}

}  // namespace triangle_distance_test
