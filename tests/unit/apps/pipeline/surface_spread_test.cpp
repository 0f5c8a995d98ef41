#include "apps/pipeline/run/surface_spread.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "levelset/mesh.h"

namespace surface_spread_test {

using Imath::Box3d;
using Imath::V3d;
using pipeline::SurfaceSpread;

/// A square from the origin in the plane z = 0.01, of two triangles.
levelset::TriMesh square(double side) {
  return {
      .positions = {V3d(0, 0, 0.01), V3d(side, 0, 0.01), V3d(side, side, 0.01), V3d(0, side, 0.01)},
      .triangles = {{0, 1, 2}, {0, 2, 3}}};
}

TEST(SurfaceSpread, LargeTrianglesAreSpreadOverTheirCells) {
  SurfaceSpread spread(0.1);
  spread.add(square(10));
  EXPECT_NEAR(spread.within({V3d(0, 0, 0), V3d(5, 5, 1)}), 0.25, 0.01);
  EXPECT_NEAR(spread.within({V3d(2, 0, 0), V3d(3, 10, 1)}), 0.1, 0.01);
  EXPECT_EQ(spread.within({V3d(0, 0, 1), V3d(10, 10, 9)}), 0);
  EXPECT_NEAR(spread.within({V3d(-1e9), V3d(1e9)}), 1, 1e-12);
}

TEST(SurfaceSpread, ACellCountsByItsShareInTheBox) {
  SurfaceSpread spread(1);
  spread.add(V3d(-0.5, 0.5, 0.5), 3);
  spread.add(V3d(7.5, 0.5, 0.5), 1);
  EXPECT_DOUBLE_EQ(spread.within({V3d(-0.25, -5, -5), V3d(5)}), 0.75 / 4);
  EXPECT_DOUBLE_EQ(spread.within({V3d(5, 0, 0), V3d(9, 0.5, 1)}), 0.125);
  EXPECT_DOUBLE_EQ(spread.within({V3d(2, -5, -5), V3d(5)}), 0);
}

TEST(SurfaceSpread, TheDensestSlabBeginsOrEndsAtACell) {
  SurfaceSpread spread(1);
  const std::vector<std::pair<int, double>> amounts = {{-3, 1}, {-2, 2}, {0, 3}, {1, 1}, {6, 3}};
  for (const auto& [x, amount] : amounts) spread.add(V3d(x + 0.5, 0.5, 0.5), amount);
  const Box3d everywhere(V3d(-1e9), V3d(1e9));
  EXPECT_DOUBLE_EQ(spread.inDensestSlab(everywhere, 0.5), 0.15);
  EXPECT_DOUBLE_EQ(spread.inDensestSlab(everywhere, 1), 0.3);
  EXPECT_DOUBLE_EQ(spread.inDensestSlab(everywhere, 1.5), 0.35);  // 0 to 1.5
  EXPECT_DOUBLE_EQ(spread.inDensestSlab(everywhere, 3), 0.5);     // -2 to 1
  EXPECT_DOUBLE_EQ(spread.inDensestSlab(everywhere, 100), 1);
  EXPECT_DOUBLE_EQ(spread.inDensestSlab({V3d(-1e9), V3d(0.5, 0.5, 9)}, 1), 0.1);
  EXPECT_EQ(spread.inDensestSlab({V3d(3, -9, -9), V3d(5, 9, 9)}, 1), 0);
}

TEST(SurfaceSpread, NoSurfaceHasNoShare) {
  EXPECT_EQ(SurfaceSpread(1).within({V3d(-1e9), V3d(1e9)}), 0);
  EXPECT_EQ(SurfaceSpread(1).inDensestSlab({V3d(-1e9), V3d(1e9)}, 1), 0);
}

}  // namespace surface_spread_test
