#include "levelset/distance/closest_points.h"

#include <gtest/gtest.h>

#include <limits>

#include "levelset/error.h"
#include "levelset/fields/grid_vdb.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"

namespace closest_points_test {

using namespace levelset;
using Imath::V3d;

const V3d kCentre(0.013, -0.007, 0.021);

NarrowBand ball(int voxelsPerUnit, double slope = 1) {
  return support::sampleBand([=](const V3d& p) { return slope * ((p - kCentre).length() - 1); },
                             {V3d(-1.1), V3d(1.1)}, 1.0 / voxelsPerUnit);
}

struct Worst {
  double offSurface = 0, offNormal = 0;  ///< voxels
  std::size_t count = 0;
};

Worst worst(const FieldGrid& field) {
  const openvdb::Vec3SGrid& grid = *field.shared()->vector;
  Worst w;
  for (auto it = grid.cbeginValueOn(); it; ++it, ++w.count) {
    const V3d x = toImath(grid.indexToWorld(it.getCoord())) - kCentre;
    const V3d p = V3d((*it).x(), (*it).y(), (*it).z()) - kCentre;
    w.offSurface = std::max(w.offSurface, std::abs(p.length() - 1) / grid.voxelSize()[0]);
    w.offNormal = std::max(w.offNormal, (p - x.normalized()).length() / grid.voxelSize()[0]);
  }
  return w;
}

TEST(ClosestPoints, LieOnTheSurfaceAlongTheNormal) {
  const Worst w = worst(closestPoints(ball(20), {.halfWidth = 6}));
  EXPECT_LE(w.offSurface, support::measured(1.44e-4));
  EXPECT_LE(w.offNormal, support::measured(0.00458));
  EXPECT_NEAR(static_cast<double>(w.count), 4 * M_PI * 400 * 12,
              support::measured(0.0299) * 4 * M_PI * 400 * 12);
}

TEST(ClosestPoints, DoNotDependOnTheSlope) {
  EXPECT_LE(worst(closestPoints(ball(20, 1.7), {.halfWidth = 4})).offSurface,
            support::measured(7.17e-4));
}

TEST(ClosestPoints, ConvergeOnTheSurface) {
  double previous = 0;
  for (const int n : {8, 16, 32}) {
    const double error = worst(closestPoints(ball(n))).offSurface / n;
    if (previous > 0) {
      EXPECT_GE(std::log2(previous / error), support::measuredOrder(3.03)) << n;
    }
    previous = error;
  }
}

TEST(ClosestPoints, CarryAnAttributeAlongNormals) {
  const auto attribute = [](const V3d& p) { return std::atan2(p.y, p.x) + p.z * p.z; };
  // Away from the jump of the angle.
  const FieldGrid field = extendOffSurface(ball(20), attribute, {.halfWidth = 5});
  const openvdb::FloatGrid& grid = *field.shared()->scalar;
  double error = 0;
  std::size_t count = 0;
  for (auto it = grid.cbeginValueOn(); it; ++it) {
    const V3d x = toImath(grid.indexToWorld(it.getCoord())) - kCentre;
    if (x.x < 0.2) continue;
    const double truth = attribute(kCentre + x.normalized());
    error = std::max(error, std::abs(static_cast<double>(*it) - truth));
    ++count;
  }
  EXPECT_GT(count, 10000u);
  EXPECT_LE(error, support::measured(2.34e-4));
}

TEST(ClosestPoints, CarryVectorsByComponent) {
  const VectorField spin = [](const V3d& p, double time) { return V3d(-p.y, p.x, p.z + time); };
  const NarrowBand solid = ball(12);
  const FieldGrid vectors = extendOffSurface(solid, spin);
  ASSERT_TRUE(vectors.isVector());
  for (int i = 0; i < 3; ++i) {
    const ScalarField one = [&](const V3d& p) { return spin(p, 0)[i]; };
    const FieldGrid numbers = extendOffSurface(solid, one);
    const auto accessor = vectors.shared()->vector->getConstAccessor();
    for (auto it = numbers.shared()->scalar->cbeginValueOn(); it; ++it)
      ASSERT_EQ(accessor.getValue(it.getCoord())[i], *it) << it.getCoord();
  }
}

TEST(ClosestPoints, Refuse) {
  EXPECT_THROW((void)closestPoints(NarrowBand()), InvalidInput);
  EXPECT_THROW((void)closestPoints(ball(8), {.halfWidth = 0.5}), UsageError);
  EXPECT_THROW((void)closestPoints(ball(8), {.halfWidth = 1e6}), ResourceLimit);
  EXPECT_THROW((void)extendOffSurface(ball(8), ScalarField()), UsageError);
  EXPECT_THROW((void)extendOffSurface(ball(8), VectorField()), UsageError);
  const auto undefined = [](const V3d&) { return std::numeric_limits<double>::quiet_NaN(); };
  EXPECT_THROW((void)extendOffSurface(ball(8), undefined), InvalidInput);
}

}  // namespace closest_points_test
