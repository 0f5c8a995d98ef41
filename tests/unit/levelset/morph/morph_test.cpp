#include "levelset/morph/morph.h"

#include <gtest/gtest.h>
#include <openvdb/tools/Diagnostics.h>

#include <limits>

#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"

namespace morph_test {

using namespace levelset;
using Imath::V3d;

/// Number of grid points inside exactly one of two solids.
std::size_t symmetricDifference(const NarrowBand& a, const NarrowBand& b) {
  openvdb::CoordBBox box = vdb(a).evalActiveVoxelBoundingBox();
  box.expand(vdb(b).evalActiveVoxelBoundingBox());
  auto x = vdb(a).getConstAccessor(), y = vdb(b).getConstAccessor();
  std::size_t count = 0;
  for (auto it = box.begin(); it; ++it) count += (x.getValue(*it) < 0) != (y.getValue(*it) < 0);
  return count;
}

void expectSameSurface(const NarrowBand& a, const NarrowBand& b) {
  auto accessor = vdb(b).getConstAccessor();
  for (auto it = vdb(a).cbeginValueOn(); it; ++it) {
    if (std::abs(*it) < 1) {
      ASSERT_NEAR(*it, accessor.getValue(it.getCoord()), support::rounding(1));
    }
  }
}

void expectMonotone(const NarrowBand& from, const NarrowBand& to, int steps) {
  std::size_t previous = symmetricDifference(from, to);
  int seen = 0;
  const NarrowBand last =
      morph(from, to, {.steps = steps, .keep = [&](const NarrowBand& step, int n) {
                         EXPECT_EQ(n, ++seen);
                         EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(step), 6), "");
                         const std::size_t now = symmetricDifference(step, to);
                         if (previous > 0) {
                           EXPECT_LT(now, previous) << n;
                         }
                         previous = now;
                       }});
  EXPECT_EQ(seen, steps);
  EXPECT_EQ(previous, 0u);
  expectSameSurface(last, to);
}

TEST(Morph, MovesABallNearerWithEveryStep) {
  expectMonotone(makeSphere(16, V3d(0.3, 0.2, 0.1), 1), makeSphere(16, V3d(8.3, 0.2, 0.1), 1), 20);
}

TEST(Morph, TurnsABallIntoABoxAndBack) {
  const NarrowBand ball = makeSphere(12, V3d(0.3, 0.2, 0.1), 1);
  const NarrowBand box = makeBox(V3d(20, 18, 22), V3d(0.3, 0.2, 0.1), 1);
  expectMonotone(ball, box, 4);
  expectMonotone(box, ball, 4);
}

TEST(Morph, ChangesTheTopology) {
  const NarrowBand ball = makeSphere(14, V3d(0.3, 0.2, 0.1), 1);
  const NarrowBand ring = makeTorus(12, 5, V3d(0.3, 0.2, 0.1), V3d(0, 0, 1), 1);
  expectMonotone(ball, ring, 5);
  expectMonotone(ring, ball, 5);
  EXPECT_EQ(measure(morph(ball, ring)).euler, 0);
}

TEST(Morph, FollowsTheMask) {
  // Radius 20 on one side, 12 on the other, and in between where the mask is a half. Between these
  // the surface has walls.
  const NarrowBand from = makeSphere(12, V3d(0.2), 1), to = makeSphere(20, V3d(0.2), 1);
  const auto radiusAlong = [](const NarrowBand& band, const V3d& direction) {
    const BandSampler sampler(band, Interpolation::Tricubic);
    double inside = 0, outside = 30;
    for (int i = 0; i < 30; ++i) {
      const double middle = (inside + outside) / 2;
      const V3d p = V3d(0.2) + middle * direction.normalized();
      (sampler.value(p) < 0 ? inside : outside) = middle;
    }
    return inside;
  };
  const auto masked = [&](const Mask& mask, int steps) {
    return morph(from, to, {.steps = steps, .mask = mask});
  };
  const Mask right = {.field = [](const V3d& p) { return p.x; }, .min = -2, .max = 2};
  const NarrowBand mixed = masked(right, 1);
  EXPECT_NEAR(radiusAlong(mixed, V3d(1, 0.3, 0.2)), 20, support::measured(3.65e-5));
  EXPECT_NEAR(radiusAlong(mixed, V3d(-1, 0.3, 0.2)), 12, support::measured(5.1e-5));
  EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(mixed), 6), "");

  Mask left = right;
  left.invert = true;
  EXPECT_NEAR(radiusAlong(masked(left, 1), V3d(1, 0.3, 0.2)), 12, support::measured(5.94e-5));
  const Mask half = {.field = [](const V3d&) { return 0.5; }};
  EXPECT_NEAR(radiusAlong(masked(half, 1), V3d(1, 2, 3)), 16, support::measured(1.16e-4));
  EXPECT_NEAR(radiusAlong(masked(half, 3), V3d(1, 2, 3)), 16, support::measured(1.16e-4));
}

TEST(Morph, StopsAtAnIntermediateTime) {
  const NarrowBand half =
      morph(makeSphere(8, V3d(0.2), 1), makeSphere(16, V3d(0.2), 1), {.until = 0.5});
  EXPECT_NEAR(std::cbrt(3 * measure(half).volume / (4 * M_PI)), 12, support::rounding(5));
}

TEST(Morph, EndsWithinTheTolerance) {
  // Radii 8, 10, 12, 14, 16: the fourth is the first within 2.1 of the target.
  int steps = 0;
  const NarrowBand result =
      morph(makeSphere(6, V3d(0.2), 1), makeSphere(16, V3d(0.2), 1),
            {.steps = 5, .tolerance = 2.1, .keep = [&](const NarrowBand&, int n) { steps = n; }});
  EXPECT_EQ(steps, 4);
  EXPECT_NEAR(std::cbrt(3 * measure(result).volume / (4 * M_PI)), 14, support::rounding(30));
}

TEST(Morph, WorksAcrossGrids) {
  const NarrowBand ball = makeSphere(1, V3d(0), 0.1), box = makeBox(V3d(1.6), V3d(0.1, 0, 0), 0.13);
  const NarrowBand result = morph(ball, box, {.steps = 3});
  EXPECT_NEAR(result.voxelSize(), 0.1, support::doubleRounding(4));
  EXPECT_NEAR(measure(result).volume, measure(box).volume,
              support::measured(0.0132) * measure(box).volume);
}

TEST(Morph, RefusesSeparateSolidsUnlessInOneStep) {
  const NarrowBand a = makeSphere(4, V3d(0.2), 1), b = makeSphere(4, V3d(14.2, 0.2, 0.2), 1);
  EXPECT_THROW((void)morph(a, b, {.steps = 10}), InvalidInput);
  EXPECT_EQ(symmetricDifference(morph(a, b), b), 0u);
}

TEST(Morph, Refuses) {
  const NarrowBand a = makeSphere(6, V3d(0.2), 1);
  EXPECT_THROW((void)morph(a, a, {.steps = 0}), UsageError);
  EXPECT_THROW((void)morph(a, a, {.until = 0}), UsageError);
  EXPECT_THROW((void)morph(a, a, {.tolerance = 0}), UsageError);
  EXPECT_THROW((void)morph(a, a, {.until = std::numeric_limits<double>::quiet_NaN()}), UsageError);
  EXPECT_THROW((void)morph(a, a, {.mask = Mask()}), UsageError);
  EXPECT_THROW((void)morph(NarrowBand(), a), InvalidInput);
  EXPECT_THROW((void)morph(a, NarrowBand()), InvalidInput);
  EXPECT_THROW((void)morph(a, a, {.steps = 2, .maxMemory = 1000}), ResourceLimit);
  EXPECT_THROW((void)morph(a, a, {.progress = [](double) { return false; }}), Cancelled);
}

}  // namespace morph_test
