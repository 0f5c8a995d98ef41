#include "levelset/distance/surface/surface_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "levelset/shapes/shapes.h"
#include "tests/support/measured.h"

namespace surface_points_test {

using levelset::NarrowBand;

/// Mean difference between the distances that thicken() adds and the exact ones, voxels, on the
/// grid points outside (`side` 1) or inside (−1) of a ball.
double thickenError(double radius, int side) {
  const Imath::V3d center(0.31, 0.12, -0.23);
  const NarrowBand band = levelset::makeSphere(radius, center, 1, {.halfWidth = 3});
  const openvdb::FloatTree& before = levelset::vdb(band).tree();
  const openvdb::FloatTree::Ptr after = levelset::eikonal::thicken(before);
  double sum = 0;
  std::size_t added = 0;
  for (auto it = after->cbeginValueAll(); it; ++it) {
    if (!it.isVoxelValue() || std::abs(*it) == before.background()) continue;
    const openvdb::Coord c = it.getCoord();
    if (std::abs(before.getValue(c)) != before.background()) continue;
    const double exact = (levelset::toImath(c.asVec3d()) - center).length() - radius;
    if (exact * side < 0) continue;
    ++added;
    sum += std::abs(static_cast<double>(*it) - exact);
  }
  EXPECT_GT(added, 100u);
  return sum / static_cast<double>(added);
}

TEST(SurfacePoints, ThickenedBandsContinueTheirDistances) {
  for (const int side : {-1, 1}) {
    const bool isInside = side < 0;
    std::vector<double> errors;
    for (const double radius : {12.0, 24.0, 48.0}) errors.push_back(thickenError(radius, side));
    EXPECT_LE(errors[0], support::measured(isInside ? 0.0233 : 0.0129));
    EXPECT_LE(errors[2], support::measured(isInside ? 8.62e-4 : 7.92e-4));
    EXPECT_GE(std::log2(errors[0] / errors[1]), support::measuredOrder(isInside ? 2.44 : 1.97));
    EXPECT_GE(std::log2(errors[1] / errors[2]), support::measuredOrder(isInside ? 2.32 : 2.05));
  }
}

}  // namespace surface_points_test
