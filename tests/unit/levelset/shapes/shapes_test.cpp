#include "levelset/shapes/shapes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "levelset/error.h"
#include "levelset/vdb.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace shapes_test {

using namespace levelset;
using Imath::V3d;

/// Distance to the nearest of many surface points, `spacing` apart. An independent, slow bound on
/// the distance from both sides.
double nearest(const std::vector<V3d>& surface, const V3d& p) {
  double best = std::numeric_limits<double>::max();
  for (const V3d& s : surface) best = std::min(best, (s - p).length2());
  return std::sqrt(best);
}

void expectDistances(const NarrowBand& band, const std::vector<V3d>& surface, double spacing) {
  std::size_t count = 0;
  support::forEachActive(band, [&](const V3d& p, double phi) {
    if (++count % 7 != 0) return;
    const double truth = nearest(surface, p);
    EXPECT_GT(truth, std::abs(phi) - 1e-6) << p;
    EXPECT_LT(truth, std::hypot(phi, spacing)) << p;
  });
  EXPECT_GT(count, 1000u);
}

/// Points of a surface of revolution about the z axis, from points (r, z) of its profile.
std::vector<V3d> revolve(const std::vector<std::pair<double, double>>& profile, int turns) {
  std::vector<V3d> points;
  for (const auto& [r, z] : profile)
    for (int i = 0; i < turns; ++i) {
      const double angle = 2 * M_PI * i / turns;
      points.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
    }
  return points;
}

/// Expects the same active grid points and the same values as the formula everywhere, on both
/// sides.
void expectSampled(const NarrowBand& band, const std::function<double(const V3d&)>& phi,
                   const Imath::Box3d& box) {
  const NarrowBand truth = support::sampleBand(phi, box, band.voxelSize(), band.halfWidth());
  EXPECT_EQ(band.activeVoxelCount(), truth.activeVoxelCount());
  const auto a = vdb(band).getConstAccessor(), b = vdb(truth).getConstAccessor();
  openvdb::CoordBBox all = vdb(truth).evalActiveVoxelBoundingBox();
  all.expand(3);
  for (const openvdb::Coord& c : all) {
    ASSERT_NEAR(a.getValue(c), b.getValue(c), support::rounding(3) * band.voxelSize()) << c;
    ASSERT_EQ(a.isValueOn(c), b.isValueOn(c)) << c;
  }
}

TEST(Shapes, SphereHoldsTheDistanceOnBothSides) {
  const V3d center(0.013, -0.2, 0.31);
  expectSampled(makeSphere(1, center, 0.07),
                [&](const V3d& p) { return (p - center).length() - 1; },
                {center - V3d(1), center + V3d(1)});
  expectSampled(makeSphere(1, center, 0.07, {.halfWidth = 6.5}),
                [&](const V3d& p) { return (p - center).length() - 1; },
                {center - V3d(1), center + V3d(1)});
}

TEST(Shapes, BoxIsExactAtEdgesAndAcrossItsMedialAxis) {
  std::vector<V3d> surface;
  const V3d half(0.5, 0.35, 0.2);
  const int n = 60;
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n; ++j)
        for (const int side : {-1, 1}) {
          V3d p;
          p[axis] = side * half[axis];
          p[(axis + 1) % 3] = half[(axis + 1) % 3] * (2.0 * i / n - 1);
          p[(axis + 2) % 3] = half[(axis + 2) % 3] * (2.0 * j / n - 1);
          surface.push_back(p + V3d(0.01, 0.02, 0.03));
        }
  expectDistances(makeBox(half * 2, V3d(0.01, 0.02, 0.03), 0.05, {.halfWidth = 5}), surface, 0.015);
}

TEST(Shapes, TorusFollowsItsAxis) {
  const double radius = 0.6, tube = 0.25;
  std::vector<std::pair<double, double>> circle;
  for (int i = 0; i < 200; ++i)
    circle.emplace_back(radius + tube * std::cos(2 * M_PI * i / 200),
                        tube * std::sin(2 * M_PI * i / 200));
  const std::vector<V3d> flat = revolve(circle, 300);
  expectDistances(makeTorus(radius, tube, V3d(0), V3d(0, 0, 2), 0.05), flat, 0.015);
  std::vector<V3d> tilted;
  for (const V3d& p : flat) tilted.emplace_back(p.z + 0.1, p.x, p.y);
  expectDistances(makeTorus(radius, tube, V3d(0.1, 0, 0), V3d(3, 0, 0), 0.05), tilted, 0.015);
}

TEST(Shapes, SpindleTorusIsTheUnionOfItsProfiles) {
  const double radius = 0.3, tube = 0.5;
  std::vector<std::pair<double, double>> arc;
  for (int i = 0; i < 400; ++i) {
    const double angle = 2 * M_PI * i / 400;
    const double r = radius + tube * std::cos(angle);
    if (r >= 0) arc.emplace_back(r, tube * std::sin(angle));
  }
  arc.emplace_back(0, 0.4);
  arc.emplace_back(0, -0.4);
  const NarrowBand band = makeTorus(radius, tube, V3d(0), V3d(0, 0, 1), 0.04, {.halfWidth = 4});
  expectDistances(band, revolve(arc, 300), 0.015);
  EXPECT_LT(vdb(band).tree().getValue(openvdb::Coord(0)), 0) << "the middle is solid";
  EXPECT_LT(vdb(makeTorus(0.5, 0.5, V3d(0.01), V3d(0, 0, 1), 0.05)).tree().getValue({4, 0, 0}), 0);
}

TEST(Shapes, CylinderIsExactAtRimAndMedialAxis) {
  const double radius = 0.4, height = 0.6;
  std::vector<std::pair<double, double>> profile;
  for (int i = 0; i <= 80; ++i) {
    profile.emplace_back(radius, height * (i / 80.0 - 0.5));
    profile.emplace_back(radius * i / 80.0, height / 2);
    profile.emplace_back(radius * i / 80.0, -height / 2);
  }
  std::vector<V3d> surface;
  for (const V3d& p : revolve(profile, 250)) surface.emplace_back(p.y, p.z, p.x);  // maps z to y
  expectDistances(makeCylinder(radius, height, V3d(0), V3d(0, -1, 0), 0.04, {.halfWidth = 6}),
                  surface, 0.015);
}

TEST(Shapes, CapsuleWithoutLengthIsASphere) {
  const V3d c(0.02, 0.5, -0.1);
  EXPECT_EQ(makeCapsule(c, c, 0.5, 0.06).contentHash(), makeSphere(0.5, c, 0.06).contentHash());
  const V3d a(-0.4, 0, 0.1), b(0.5, 0.3, 0);
  const NarrowBand band = makeCapsule(a, b, 0.3, 0.06);
  support::forEachActive(band, [&](const V3d& p, double phi) {
    double best = 10;
    for (int i = 0; i <= 400; ++i) best = std::min(best, (p - a - (b - a) * (i / 400.0)).length());
    ASSERT_NEAR(phi, best - 0.3, support::measured(5.4e-6)) << p;
  });
}

TEST(Shapes, LargeSphereFillsItsInsideWithTiles) {
  const NarrowBand band = makeSphere(300, V3d(0.3), 1);
  EXPECT_NEAR(static_cast<double>(band.activeVoxelCount()), 4 * M_PI * 300 * 300 * 6,
              support::measured(425));
  EXPECT_LT(static_cast<double>(band.memoryUse()), 3.2e7 * 4)
      << "memory exceeds that of the surface leaves";
  for (int x = -299; x < 300; x += 13)
    for (int y = -299; y < 300; y += 17) {
      const double phi = (V3d(x, y, 5) - V3d(0.3)).length() - 300;
      ASSERT_NEAR(vdb(band).tree().getValue({x, y, 5}), std::clamp(phi, -3.0, 3.0),
                  support::rounding(1.25));
    }
}

TEST(Shapes, FarFromTheOriginPrecisionIsKept) {
  const V3d far(1e6, -1e6, 1e6);
  const NarrowBand here = makeSphere(1, V3d(0), 0.0625), there = makeSphere(1, far, 0.0625);
  EXPECT_EQ(here.activeVoxelCount(), there.activeVoxelCount());
  support::forEachActive(there, [&](const V3d& p, double phi) {
    ASSERT_NEAR(phi, (p - far).length() - 1, support::measured(7.43e-9));
  });
}

TEST(Shapes, ScaleWithTheirVoxels) {
  // Powers of two scale every intermediate result exactly: the same tree, and values scaled to the
  // bit.
  const NarrowBand small = makeTorus(0.6, 0.25, V3d(0.1), V3d(1, 2, 3), 1.0 / 32);
  const NarrowBand large = makeTorus(0.6 * 1024, 0.25 * 1024, V3d(102.4), V3d(1, 2, 3), 32);
  ASSERT_TRUE(vdb(small).tree().hasSameTopology(vdb(large).tree()));
  auto a = vdb(small).cbeginValueOn();
  for (auto b = vdb(large).cbeginValueOn(); b; ++a, ++b) ASSERT_EQ(*a * 1024, *b);
}

TEST(Shapes, SameBitsForAnyNumberOfThreads) {
  std::vector<std::uint64_t> hashes;
  for (const std::size_t threads : {1, 2, 4}) {
    hashes.push_back(support::onThreads(
        threads, [] { return makeTorus(20, 6, V3d(0.3), V3d(1, 1, 0), 0.25).contentHash(); }));
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(Shapes, RefuseInvalidLengths) {
  const double nan = std::nan(""), infinite = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -1.0, nan, infinite}) {
    EXPECT_THROW((void)makeSphere(bad, V3d(0), 0.1), UsageError) << bad;
    EXPECT_THROW((void)makeSphere(1, V3d(0), bad), UsageError) << bad;
    EXPECT_THROW((void)makeSphere(1, V3d(0), 0.1, {.halfWidth = bad}), UsageError) << bad;
    EXPECT_THROW((void)makeBox(V3d(1, 1, bad), V3d(0), 0.1), UsageError) << bad;
    EXPECT_THROW((void)makeTorus(1, bad, V3d(0), V3d(0, 0, 1), 0.1), UsageError) << bad;
    EXPECT_THROW((void)makeCylinder(1, bad, V3d(0), V3d(0, 0, 1), 0.1), UsageError) << bad;
    EXPECT_THROW((void)makeCapsule(V3d(0), V3d(1), bad, 0.1), UsageError) << bad;
  }
  EXPECT_THROW((void)makeSphere(1, V3d(nan, 0, 0), 0.1), UsageError);
  EXPECT_THROW((void)makeTorus(1, 0.2, V3d(0), V3d(0), 0.1), UsageError);
  EXPECT_THROW((void)makeCapsule(V3d(0), V3d(infinite, 0, 0), 0.2, 0.1), UsageError);
  EXPECT_THROW((void)makeSphere(1, V3d(0), 0.1, {.halfWidth = 0.9}), UsageError);
}

TEST(Shapes, RefuseVoxelsThatMissTheShape) {
  EXPECT_THROW((void)makeSphere(1, V3d(0), 2.1), InvalidInput);
  EXPECT_THROW((void)makeBox(V3d(10, 10, 0.1), V3d(0, 0, 0.25), 0.5), InvalidInput)
      << "no grid point is inside";
  EXPECT_NO_THROW((void)makeBox(V3d(10, 10, 0.1), V3d(0), 0.5));
}

TEST(Shapes, RefuseShapesThatExceedMemory) {
  EXPECT_THROW((void)makeSphere(1, V3d(0), 1e-9), ResourceLimit);
  EXPECT_THROW((void)makeSphere(1, V3d(1e12, 0, 0), 0.1), ResourceLimit);
  EXPECT_THROW((void)makeSphere(1, V3d(0), 0.001, {.maxMemory = 100'000'000}), ResourceLimit);
  // The estimate is at least the actual memory, and less than twice as much.
  const NarrowBand band = makeSphere(1, V3d(0), 0.01);
  EXPECT_THROW((void)makeSphere(1, V3d(0), 0.01, {.maxMemory = band.memoryUse()}), ResourceLimit);
  EXPECT_NO_THROW((void)makeSphere(1, V3d(0), 0.01, {.maxMemory = 2 * band.memoryUse()}));
}

TEST(Shapes, StopWhenCancelled) {
  EXPECT_THROW((void)makeSphere(1, V3d(0), 0.01, {.progress = [](double) { return false; }}),
               Cancelled);
  double last = 0;
  (void)makeSphere(1, V3d(0), 0.01, {.progress = [&](double fraction) {
                     EXPECT_GE(fraction, last);
                     last = fraction;
                     return true;
                   }});
  EXPECT_EQ(last, 1);
}

}  // namespace shapes_test
