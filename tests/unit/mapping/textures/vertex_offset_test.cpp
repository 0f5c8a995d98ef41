#include "tests/bench/vertex_offset.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/measured.h"
#include "tests/support/meshes.h"

// The baseline of vertex_offset_bench.
namespace vertex_offset_test {

using Imath::V3d;
using levelset::TriMesh;

std::size_t intersections(const TriMesh& mesh) {
  return levelset::convert::findSelfIntersections(mesh.triangles, mesh.positions, {}).size();
}

/// Sheet with a V-shaped valley along y, 2 wide, and 1 deep. Its sides meet at a right angle.
TriMesh valley() {
  return support::patchMesh(41, 9, false, false, [](double u, double v) {
    const double x = 2 * u - 1;
    return V3d(x, v - 0.5, std::abs(x));
  });
}

TEST(VertexOffset, ConvexSurfacesMoveByTheDistance) {
  const TriMesh ball = support::sphereMesh(1);
  const vertex_offset::Result moved = vertex_offset::offsetWithRetreat(ball, 0.5, 4);
  EXPECT_EQ(moved.locked, 0u);
  EXPECT_EQ(moved.mesh.triangles, ball.triangles);
  double worst = 0;
  for (const V3d& p : moved.mesh.positions) worst = std::max(worst, std::abs(p.length() - 1.5));
  EXPECT_LE(worst, support::measured(1.22e-6));
  const vertex_offset::Result atOnce = vertex_offset::offsetAtOnce(ball, 0.5);
  for (std::size_t v = 0; v < atOnce.mesh.positions.size(); ++v)
    EXPECT_LT((atOnce.mesh.positions[v] - moved.mesh.positions[v]).length(),
              support::doubleRounding(4));
}

// In the valley the true offset meets in a line at height √2 d. Vertices beside it collide early
// and stay below.
TEST(VertexOffset, RetreatsInAValley) {
  const TriMesh base = valley();
  const double distance = 0.3;
  EXPECT_EQ(intersections(base), 0u);
  EXPECT_GT(intersections(vertex_offset::offsetAtOnce(base, distance).mesh), 30u);
  const vertex_offset::Result moved = vertex_offset::offsetWithRetreat(base, distance, 16);
  EXPECT_EQ(intersections(moved.mesh), 0u);
  EXPECT_GT(moved.locked, 50u);
  EXPECT_LT(moved.locked, base.positions.size());
  double least = distance;
  for (std::size_t v = 0; v < base.positions.size(); ++v) {
    EXPECT_GE(moved.reached[v], 0);
    EXPECT_LE(moved.reached[v], distance);
    EXPECT_NEAR((moved.mesh.positions[v] - base.positions[v]).length(), moved.reached[v],
                support::doubleRounding(4));
    least = std::min(least, moved.reached[v]);
  }
  EXPECT_LT(least, 0.25 * distance);
}

// A base that intersects itself cannot move there, and the search for a free position ends.
TEST(VertexOffset, StaysWhereTheBaseIntersectsItself) {
  TriMesh mesh = support::sphereMesh(1, V3d(0), 8);
  levelset::append(mesh, support::sphereMesh(1, V3d(1, 0, 0), 8));
  const std::size_t before = intersections(mesh);
  ASSERT_GT(before, 0u);
  const vertex_offset::Result moved = vertex_offset::offsetWithRetreat(mesh, 0.1, 2);
  EXPECT_GT(moved.locked, 0u);
  EXPECT_GE(intersections(moved.mesh), before);
}

}  // namespace vertex_offset_test
