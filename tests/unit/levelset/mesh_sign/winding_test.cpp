#include "levelset/mesh_sign/winding.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/measured.h"

namespace winding_test {

using Imath::V3d;
using levelset::convert::WeightedTriangle;
using levelset::convert::WindingField;

/// Triangles of a unit ball's lower part, up to the polar angle `end`; π: the complete ball.
std::vector<WeightedTriangle> ballTriangles(double end, double weight) {
  constexpr int kRings = 40, kSectors = 60;
  const auto at = [&](int ring, int sector) {
    const double polar = end * ring / kRings, angle = 2 * M_PI * (sector % kSectors) / kSectors;
    return V3d(std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle),
               -std::cos(polar));
  };
  std::vector<WeightedTriangle> triangles;
  for (int i = 0; i < kRings; ++i)
    for (int j = 0; j < kSectors; ++j) {
      const V3d a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
      triangles.push_back({{a, c, b}, weight});
      triangles.push_back({{a, d, c}, weight});
    }
  return triangles;
}

const std::vector<V3d> kPoints = {V3d(0.1, -0.2, 0.3), V3d(0, 0, -0.8), V3d(0.5, 0.5, 0.5),
                                  V3d(1.4, 0.3, 0),    V3d(0, 0, 3),    V3d(-2, 5, -4)};

TEST(Winding, CountsTheTurnsOfAClosedMesh) {
  const WindingField once(ballTriangles(M_PI, 1)), twice(ballTriangles(M_PI, 2));
  for (const V3d& p : kPoints) {
    const double inside = p.length() < 1 ? 1 : 0;
    EXPECT_NEAR(once.exact(p), inside, support::doubleRounding(100)) << p;
    EXPECT_NEAR(twice.exact(p), 2 * inside, support::doubleRounding(200)) << p;
  }
}

TEST(Winding, FarClustersMeetTheTolerance) {
  const WindingField open(ballTriangles(2.2, 1));
  for (const V3d& p : kPoints)
    for (const double tolerance : {1e-1, 1e-2, 1e-3, 1e-4})
      EXPECT_NEAR(open.within(tolerance, p), open.exact(p), tolerance) << p << ' ' << tolerance;
  // Far from the mesh its clusters are used, not its triangles.
  EXPECT_NE(open.within(1e-1, V3d(0, 0, 3)), open.exact(V3d(0, 0, 3)));
}

TEST(Winding, IsBoundedOnBalls) {
  const WindingField open(ballTriangles(2.2, 1));
  for (const V3d& p : kPoints) {
    const double bound = open.bound(p, 0.1);
    for (const V3d& step : {V3d(0), V3d(0.09, 0, 0), V3d(0, -0.09, 0), V3d(0, 0, 0.09)})
      EXPECT_LE(std::abs(open.exact(p + step)), bound) << p;
  }
  // Bounds far from the mesh are finite and of the order of the value.
  const V3d far(0, 0, 6);
  EXPECT_LT(open.bound(far, 0.1), 8 * std::abs(open.exact(far)));
}

}  // namespace winding_test
