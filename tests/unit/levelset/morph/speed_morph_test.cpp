#include <gtest/gtest.h>
#include <openvdb/tools/Diagnostics.h>

#include <cmath>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/inspect/compare.h"
#include "levelset/inspect/measure.h"
#include "levelset/morph/morph.h"
#include "levelset/shapes/shapes.h"
#include "levelset/vdb.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

/// The method speed of the morph.
namespace speed_morph_test {

using namespace levelset;
using Imath::V3d;

const V3d kCentre(0.3, 0.2, 0.1);

NarrowBand ball(double radius, double voxel = 1, const V3d& centre = kCentre) {
  return makeSphere(radius, centre, voxel);
}

NarrowBand speedMorph(const NarrowBand& from, const NarrowBand& to, MorphOptions options = {}) {
  options.method = MorphMethod::Speed;
  return morph(from, to, options);
}

double radiusOf(const NarrowBand& band) {
  return std::cbrt(3 * measure(band).volume / (4 * M_PI));
}

/// Number of grid points inside the first of two solids only.
std::size_t pointsInsideOnlyFirst(const NarrowBand& a, const NarrowBand& b) {
  auto x = vdb(a).getConstAccessor(), y = vdb(b).getConstAccessor();
  std::size_t count = 0;
  const openvdb::CoordBBox box = vdb(a).evalActiveVoxelBoundingBox();
  for (auto it = box.begin(); it; ++it) count += x.getValue(*it) < 0 && !(y.getValue(*it) < 0);
  return count;
}

TEST(SpeedMorph, FollowsTheExactRadiusOfConcentricBalls) {
  // The speed is R − r on the whole surface, so that r = R − (R − r0) exp(−t): the fraction s of
  // the way, inwards and outwards.
  for (const auto& [from, to] : {std::pair{6.0, 10.0}, {10.0, 6.0}}) {
    int seen = 0;
    (void)speedMorph(
        ball(from), ball(to),
        {.steps = 3,
         .until = 0.9,
         .keep = [&, from = from, to = to](const NarrowBand& step, int n) {
           ++seen;
           EXPECT_NEAR(radiusOf(step), from + (to - from) * 0.3 * n, support::measured(2.2e-4))
               << from << " " << n;
           EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(step), 6), "");
         }});
    EXPECT_EQ(seen, 3);
  }
}

TEST(SpeedMorph, ConvergesOnBalls) {
  // Errors of the radius half-way from 0.5 to 1. The error changes its sign between the voxel
  // sizes, so the order is that from the coarsest to the finest.
  const auto error = [](double voxel) {
    return std::abs(radiusOf(speedMorph(ball(0.5, voxel), ball(1, voxel), {.until = 0.5})) - 0.75);
  };
  const double coarse = error(0.2), middle = error(0.1), fine = error(0.05);
  EXPECT_LE(coarse, support::measured(6.57e-5));
  EXPECT_LT(middle, coarse);
  EXPECT_GE(std::log2(coarse / fine) / 2, support::measuredOrder(2.63));
}

TEST(SpeedMorph, GrowsMonotonicallyInsideTheTarget) {
  const NarrowBand from = ball(6), to = makeBox(V3d(18, 16, 20), kCentre, 1);
  NarrowBand previous = from;
  double volume = measure(from).volume;
  (void)speedMorph(from, to, {.steps = 4, .keep = [&](const NarrowBand& step, int n) {
                                const double now = measure(step).volume;
                                EXPECT_GT(now, volume) << n;
                                volume = now;
                                // No part of the earlier step is lost.
                                EXPECT_EQ(pointsInsideOnlyFirst(previous, step), 0u) << n;
                                previous = step;
                              }});
}

TEST(SpeedMorph, EndsOnTheTarget) {
  struct Pair {
    const char* name;
    NarrowBand from, to;
    double left;  ///< Hausdorff distance from the target, voxels
  };
  const NarrowBand small = ball(6), box = makeBox(V3d(15, 13, 17), kCentre, 1),
                   ring = makeTorus(9, 4, kCentre, V3d(0, 0, 1), 1);
  for (const Pair& pair :
       {Pair{"ball to box", small, box, 0.00233}, Pair{"box to ball", box, small, 0.0114},
        Pair{"ball to shifted ball", small, ball(6, 1, kCentre + V3d(5, 0, 0)), 0.00875},
        Pair{"box to ring", box, ring, 0.00975}}) {
    const NarrowBand end = speedMorph(pair.from, pair.to);
    const double left = compare(end, pair.to).hausdorff();
    EXPECT_LE(left, support::measured(pair.left)) << pair.name;
    EXPECT_EQ(measure(end).euler, measure(pair.to).euler) << pair.name;
  }
}

TEST(SpeedMorph, StaysAtTheStart) {
  const NarrowBand from = ball(7);
  const double moved =
      compare(speedMorph(from, makeBox(V3d(18), kCentre, 1), {.until = 1e-9}), from).hausdorff();
  EXPECT_LE(moved, support::measured(8.59e-4));
  // A target that is the solid itself.
  EXPECT_LE(compare(speedMorph(from, from), from).hausdorff(), support::measured(8.59e-4));
}

TEST(SpeedMorph, DropsAPartThatDoesNotOverlapTheTarget) {
  const NarrowBand two = unite(ball(5), ball(3, 1, kCentre + V3d(14, 0, 0)));
  const NarrowBand end = speedMorph(two, ball(6));
  EXPECT_EQ(measure(end).components, 1u);
  EXPECT_LE(compare(end, ball(6)).hausdorff(), support::measured(0.01));
}

TEST(SpeedMorph, RefusesWhatItCannotReach) {
  const NarrowBand here = ball(4), there = ball(4, 1, kCentre + V3d(14, 0, 0));
  EXPECT_THROW((void)speedMorph(here, there), InvalidInput);
  EXPECT_THROW((void)speedMorph(here, there, {.steps = 5}), InvalidInput);
  // One of two parts of the target overlaps.
  EXPECT_THROW((void)speedMorph(here, unite(here, there)), InvalidInput);
  // A cavity inside the solid.
  EXPECT_THROW((void)speedMorph(ball(10), subtract(ball(12), ball(5))), InvalidInput);
}

TEST(SpeedMorph, Refuses) {
  const NarrowBand a = ball(5);
  const Mask half = {.field = [](const V3d&) { return 0.5; }};
  EXPECT_THROW((void)speedMorph(a, ball(6), {.mask = half}), UsageError);
  EXPECT_THROW((void)speedMorph(a, ball(6), {.steps = 0}), UsageError);
  EXPECT_THROW((void)speedMorph(a, ball(6), {.progress = [](double) { return false; }}), Cancelled);
}

TEST(SpeedMorph, DoesNotDependOnThreads) {
  const NarrowBand from = ball(6), to = makeBox(V3d(14, 12, 16), kCentre, 1);
  const auto hash = [&](std::size_t threads) {
    return support::onThreads(threads,
                              [&] { return speedMorph(from, to, {.until = 0.5}).contentHash(); });
  };
  EXPECT_EQ(hash(5), hash(1));
}

}  // namespace speed_morph_test
