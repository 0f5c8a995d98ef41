#include "levelset/points/surface/signed_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "levelset/points/field/meshless.h"

namespace signed_field_test {

using Imath::V3d;
using Imath::V3f;
using namespace levelset::points;
using levelset::PointCloud;

/// Square lattice in a plane that is inclined to the grid, with two rims.
PointCloud inclinedLattice(double spacing) {
  const V3d normal = V3d(1, 1, 1).normalized(), u = V3d(1, -1, 0).normalized(), v = normal.cross(u);
  PointCloud cloud;
  for (int i = -8; i <= 8; ++i)
    for (int j = -8; j <= 8; ++j) {
      cloud.positions.push_back(spacing * (u * i + v * j));
      cloud.normals.push_back(V3f(normal));
    }
  return cloud;
}

PointCloud ball(double radius, int count) {
  PointCloud cloud;
  for (int n = 0; n < count; ++n) {
    const double z = 1 - (2 * n + 1.0) / count, r = std::sqrt(1 - z * z), turn = 2.39996 * n;
    const V3d p(r * std::cos(turn), r * std::sin(turn), z);
    cloud.positions.push_back(radius * p);
    cloud.normals.push_back(V3f(p));
  }
  return cloud;
}

/// Compares the values of cubes of the unit grid with those of a field that skips nothing. Near the
/// points, values within the bound have the same bits, and the others lie beyond it on the same
/// side.
void expectSameWithin(const PointCloud& cloud, double half, double bound) {
  const OrientedPoints points = orient(cloud);
  for (const bool isQuadric : {false, true}) {
    const SignedField field(points, isQuadric ? movingLeastSquares(points, 16)
                                              : meshless(points, 12, levelset::kNoMemoryLimit, {}));
    FieldMemory memory, fresh;
    std::size_t skipped = 0, within = 0;
    const int most = static_cast<int>(half / 4);
    for (int x = -most; x < most; ++x)
      for (int y = -most; y < most; ++y)
        for (int z = -most; z < most; ++z) {
          CubePositions at;
          for (int n = 0; n < 64; ++n) {
            const int c = n / 8, f = n % 8;
            at[static_cast<std::size_t>(n)] =
                V3d(4 * x + 2 * (c >> 2) + (f >> 2), 4 * y + 2 * (c >> 1 & 1) + (f >> 1 & 1),
                    4 * z + 2 * (c & 1) + (f & 1)) -
                points.centre;
          }
          CubeValues values, exact;
          field.values(at, values, memory, bound);
          fresh = {};
          field.values(at, exact, fresh, std::numeric_limits<double>::infinity());
          for (std::size_t n = 0; n < at.size(); ++n) {
            skipped += n > 0 && values[n] == values[n - 1];
            // Beyond about a spacing from the points, winding numbers are reused where only their
            // side counts.
            const levelset::FoundItem first =
                points.search.closest(at[n], std::numeric_limits<double>::infinity());
            if (std::sqrt(first.squared) > points.spacings[first.index]) {
              if (std::abs(exact[n]) > 1) {
                ASSERT_EQ(values[n] > 0, exact[n] > 0);
              }
            } else if (std::abs(exact[n]) < bound) {
              ++within;
              ASSERT_EQ(values[n], exact[n]);
            } else {
              ASSERT_GE(std::abs(values[n]), bound);
              ASSERT_EQ(values[n] > 0, exact[n] > 0);
            }
          }
        }
    EXPECT_GT(skipped, 0u);
    EXPECT_GT(within, 100u);
  }
}

TEST(SignedField, SkipsOnlyCubesBeyondTheBound) {
  // Spacings in voxels. The rims of the lattices are holes.
  for (const double spacing : {2.0, 6.0, 14.0})
    expectSameWithin(inclinedLattice(spacing), 2 * spacing + 12, 3);
  for (const int count : {60, 300, 4000}) expectSameWithin(ball(20, count), 28, 3);
}

}  // namespace signed_field_test
