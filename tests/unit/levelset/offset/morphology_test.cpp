#include "levelset/offset/morphology.h"

#include <gtest/gtest.h>
#include <openvdb/tools/Diagnostics.h>

#include <limits>
#include <numbers>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/inspect/check.h"
#include "levelset/inspect/compare.h"
#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"

namespace morphology_test {

using namespace levelset;
using Imath::V3d;
using std::numbers::pi;

// All shapes in voxels, off the grid points.
const V3d kCentre(0.31, -0.17, 0.43);

double boxDistance(const V3d& p, const V3d& half) {
  const V3d q(std::abs(p.x) - half.x, std::abs(p.y) - half.y, std::abs(p.z) - half.z);
  const V3d out(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
  return out.length() + std::min(0.0, std::max({q.x, q.y, q.z}));
}

NarrowBand ball(double radius, const V3d& centre = kCentre) {
  return support::sampleBand([=](const V3d& p) { return (p - centre).length() - radius; },
                             {centre - V3d(radius), centre + V3d(radius)}, 1);
}
NarrowBand box(const V3d& half, const V3d& centre = kCentre) {
  return support::sampleBand([=](const V3d& p) { return boxDistance(p - centre, half); },
                             {centre - half, centre + half}, 1);
}

double largestError(const NarrowBand& band, const std::function<double(const V3d&)>& exact) {
  double worst = 0;
  support::forEachActive(band, [&](const V3d& p, double value) {
    worst = std::max(worst, std::abs(value - exact(p)));
  });
  return worst;
}

TEST(Opening, KeepsPartsThatContainItsBall) {
  const NarrowBand sphere = ball(20);
  const NarrowBand same = opening(sphere, 12);
  EXPECT_LT(largestError(same, [](const V3d& p) { return (p - kCentre).length() - 20; }),
            support::measured(8.25e-4));
  EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(same), 6), "");
  // The edges of a box get the radius of the ball: the box shrunk by r, then grown by r.
  const double radius = 6;
  const NarrowBand rounded = opening(box(V3d(16)), radius);
  const auto exact = [&](const V3d& p) {
    return boxDistance(p - kCentre, V3d(16 - radius)) - radius;
  };
  EXPECT_LT(largestError(rounded, exact),
            support::measured(0.00593));  // edges are only as sharp as the grid resolves
  const double volume = measure(rounded).volume;
  const double edge = 2 * (16 - radius);
  const double truth = edge * edge * edge + 6 * edge * edge * radius +
                       3 * edge * pi * radius * radius + 4 * pi / 3 * radius * radius * radius;
  EXPECT_NEAR(volume, truth, support::measured(7.35e-6) * truth);
  // A second opening changes nothing.
  EXPECT_LT(compare(opening(rounded, radius), rounded).chamfer(), support::measured(2.9e-4));
}

TEST(Opening, RemovesThinParts) {
  // A ball with a plate through it.
  const NarrowBand plated = unite(ball(14), box(V3d(26, 26, 2)));
  const NarrowBand opened = opening(plated, 4);
  EXPECT_NEAR(measure(opened).bounds.size().x, 28, support::measured(0.637));
  EXPECT_NEAR(measure(opened).bounds.size().z, 28, support::measured(0.00897));
  EXPECT_THROW((void)opening(box(V3d(26, 26, 2)), 4), InvalidInput);
}

TEST(Closing, FillsNarrowGaps) {
  const NarrowBand apart = unite(box(V3d(8), V3d(-10, 0, 0)), box(V3d(8), V3d(10, 0, 0)));
  EXPECT_EQ(measure(apart).components, 2u);
  const NarrowBand closed = closing(apart, 5);
  EXPECT_EQ(measure(closed).components, 1u);
  EXPECT_NEAR(measure(closed).volume, 36 * 16 * 16,
              support::measured(0.0209, 0.03) * 36 * 16 * 16);  // up to the rim
  EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(closed), 6), "");
  const NarrowBand still = closing(apart, 1);
  EXPECT_EQ(measure(still).components, 2u);
  // Convex parts are unchanged.
  EXPECT_LT(
      largestError(closing(ball(15), 8), [](const V3d& p) { return (p - kCentre).length() - 15; }),
      support::measured(2.78e-4));
}

TEST(Shell, IsAWallOfTheGivenThickness) {
  const double radius = 18, thickness = 4;
  const NarrowBand sphere = ball(radius);
  const struct {
    ShellSide side;
    double outer;
  } cases[] = {{ShellSide::In, 18}, {ShellSide::Out, 22}, {ShellSide::Both, 20}};
  for (const auto& [side, outer] : cases) {
    const NarrowBand wall = shell(sphere, thickness, side);
    EXPECT_LT(largestError(wall,
                           [&](const V3d& p) {
                             const double r = (p - kCentre).length();
                             return std::max(r - outer, outer - thickness - r);
                           }),
              support::measured(3.34e-4));
    EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(wall), 6), "");
    const Measurement m = measure(wall);
    EXPECT_EQ(m.components, 1u);
    EXPECT_EQ(m.cavities, 1u);
  }
}

TEST(Shell, HollowsABoxWithSharpCavity) {
  const Measurement m = measure(shell(box(V3d(14, 12, 10)), 3));
  const double exact = 8 * (14. * 12 * 10 - 11. * 9 * 7);
  EXPECT_NEAR(m.volume, exact, support::rounding(8) * exact);
  EXPECT_EQ(m.cavities, 1u);
  const Measurement thin = measure(shell(ball(15), 1.5));
  const double skin = 4 * pi / 3 * (15. * 15 * 15 - 13.5 * 13.5 * 13.5);
  EXPECT_NEAR(thin.volume, skin,
              support::measured(0.0486, 6e-2) * skin);  // both surfaces are in one stencil
}

// At these voxel sizes three voxels are no float. The bands of intermediate results must still end
// at the same position to the bit.
TEST(Morphology, BuildsSoundBandsAtAnyVoxelSize) {
  for (const double voxel : {0.07, 0.13, 0.14, 0.15, 0.3}) {
    const NarrowBand solid = makeSphere(12.3 * voxel, V3d(0), voxel);
    EXPECT_EQ(solid.halfWidth(), 3) << voxel;
    const NarrowBand cube = makeBox(V3d(20 * voxel), V3d(voxel), voxel);
    const NarrowBand moved = offset(solid, 2 * voxel);
    for (const NarrowBand& result :
         {opening(cube, 2.2 * voxel), closing(solid, 2 * voxel), closing(cube, 2.9 * voxel),
          shell(cube, 2.9 * voxel, ShellSide::In), moved, unite(moved, cube),
          subtract(cube, moved)}) {
      EXPECT_EQ(vdb(result).background(), vdb(solid).background()) << voxel;
      for (const CheckItem& item : check(result).items)
        EXPECT_TRUE(item.passed) << voxel << ": " << item.name << ", " << item.detail;
    }
  }
}

TEST(Morphology, Refuses) {
  const NarrowBand sphere = ball(6);
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               infinity = std::numeric_limits<double>::infinity();
  for (const double radius : {nan, infinity, -1.0}) {
    EXPECT_THROW((void)opening(sphere, radius), UsageError);
    EXPECT_THROW((void)closing(sphere, radius), UsageError);
    EXPECT_THROW((void)shell(sphere, radius), UsageError);
  }
  EXPECT_THROW((void)shell(sphere, 0), UsageError);
  EXPECT_THROW((void)shell(sphere, 0.5), InvalidInput);
  EXPECT_THROW((void)shell(sphere, 7), InvalidInput);
  EXPECT_THROW((void)opening(sphere, 7), InvalidInput);
  for (const auto& run : {+[](const OffsetOptions& o) { (void)closing(NarrowBand(), 1, o); },
                          +[](const OffsetOptions& o) { (void)shell(NarrowBand(), 1, {}, o); }})
    EXPECT_THROW(run({}), InvalidInput);
  // A hundred times the object: the estimate refuses it before any allocation.
  OffsetOptions small;
  small.maxMemory = std::size_t{1} << 30;
  EXPECT_THROW((void)closing(sphere, 1200, small), ResourceLimit);
  EXPECT_THROW((void)shell(sphere, 1200, ShellSide::Out, small), ResourceLimit);
  small = {};
  small.progress = [](double) { return false; };
  EXPECT_THROW((void)closing(sphere, 2, small), Cancelled);
  EXPECT_THROW((void)shell(sphere, 2, ShellSide::In, small), Cancelled);
}

}  // namespace morphology_test
