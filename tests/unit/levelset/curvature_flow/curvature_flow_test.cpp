#include "levelset/curvature_flow/curvature_flow.h"

#include <gtest/gtest.h>
#include <openvdb/tools/Diagnostics.h>

#include <limits>

#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/grids/interpolate_vdb.h"
#include "levelset/inspect/compare.h"
#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace curvature_flow_test {

using namespace levelset;
using Imath::V3d;

const V3d kCentre(0.31, -0.17, 0.43);

NarrowBand ball(double radius) {
  return makeSphere(radius, kCentre, 1);
}

/// Mean and maximum over fixed rays of the zero set's distance from a centre, less `radius`.
struct RadiusError {
  double mean = 0, worst = 0;
};
RadiusError radiusError(const NarrowBand& band, double radius) {
  auto accessor = vdb(band).getConstAccessor();
  RadiusError error;
  constexpr int kRays = 500;
  for (int i = 0; i < kRays; ++i) {
    const double z = 1 - 2 * (i + 0.5) / kRays, angle = i * 2.399963, r = std::sqrt(1 - z * z);
    const V3d direction(r * std::cos(angle), r * std::sin(angle), z);
    double t = radius;
    for (int k = 0; k < 8; ++k) {
      const SampleBlock<4> block(accessor, toVdb((kCentre + direction * t) / band.voxelSize()));
      t -= block.value() / (block.gradient().dot(toVdb(direction)) / band.voxelSize());
    }
    error.mean += (t - radius) / kRays;
    error.worst = std::max(error.worst, std::abs(t - radius));
  }
  return error;
}

TEST(CurvatureFlow, ShrinksABallByTheSquareLaw) {
  for (const double time : {5.0, 40.0}) {
    const CurvatureFlowResult result = curvatureFlow(ball(20), time);
    const double radius = std::sqrt(400 - 4 * time);
    EXPECT_LE(std::abs(radiusError(result.band, radius).mean), support::measured(1.58e-4) * radius)
        << time;
    EXPECT_LE(radiusError(result.band, radius).worst, support::measured(0.00291)) << time;
    EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(result.band), 6), "");
    EXPECT_EQ(result.scheme, FlowScheme::Stabilized);
  }
}

// At first, edges keep their positions. Without edge detection, corners are a voxel off.
TEST(CurvatureFlow, StartsFromTheGivenSurface) {
  const NarrowBand cube = makeBox(V3d(20), kCentre, 1);
  double before = 0;
  for (const double time : {1e-6, 0.01, 0.1}) {
    const double change = compare(curvatureFlow(cube, time).band, cube).symmetricDifference;
    EXPECT_GT(change, before) << time;
    before = change;
    if (time < 1e-5) {
      EXPECT_LT(change, support::measured(3.54e-4)) << "area of 2400";
    }
  }
  EXPECT_GT(compare(curvatureFlow(cube, 0.5).band, cube).hausdorff(), 1);
}

TEST(SlowCurvatureFlow, HalvesTheRadiusOfABall) {
  const CurvatureFlowResult result = curvatureFlow(ball(32), 192);
  EXPECT_LE(std::abs(radiusError(result.band, 16).mean), support::measured(5.11e-4) * 16);
}

TEST(CurvatureFlow, MeasuresTimeInWorldUnits) {
  const double h = 0.01;
  const NarrowBand band = makeSphere(12 * h, kCentre * h, h);
  const NarrowBand flowed = curvatureFlow(band, 20 * h * h).band;
  const double radius = std::sqrt(144.0 - 80) * h;
  EXPECT_NEAR(std::cbrt(3 * measure(flowed).volume / (4 * M_PI)), radius,
              support::measured(8.41e-4) * radius);
}

TEST(CurvatureFlow, ConvergesWithTheVoxel) {
  // One ball, the same time, three resolutions, and steps of negligible error. The differences are
  // of higher order. The remaining error comes from redistancing, whose frequency grows with the
  // resolution.
  for (const double tolerance : {1e-3, 5e-4}) {
    std::vector<double> errors;  // relative to the radius
    for (const double n : {8.0, 16.0, 32.0}) {
      const NarrowBand flowed = curvatureFlow(ball(n), n * n / 16, {.tolerance = tolerance}).band;
      const double worst = radiusError(flowed, n * std::sqrt(0.75)).worst;
      EXPECT_LE(worst, support::measured(0.00215, 2.5e-3)) << n;
      errors.push_back(worst / n);
    }
    EXPECT_GE(std::log2(errors[0] / errors[2]) / 2, support::measuredOrder(1.8)) << tolerance;
    EXPECT_LE(errors[2], errors[1]) << tolerance;
    // The shorter the steps, the larger the share of redistancing in the finest error.
    if (tolerance == 1e-3) {
      EXPECT_GE(std::log2(errors[0] / errors[1]), support::measuredOrder(3.28));
      EXPECT_GE(std::log2(errors[1] / errors[2]), support::measuredOrder(0.845, 0.8));
    }
  }
}

// Far from the surface, level sets follow nearer ones as parallel surfaces. With one rule for all,
// halving this radius left an error of 0.044 voxels, six times the estimate.
TEST(CurvatureFlow, HasTheEstimatedError) {
  const CurvatureFlowResult result = curvatureFlow(ball(16), 48);
  EXPECT_LE(radiusError(result.band, 8).worst, support::measured(0.0116, 0.015));
  EXPECT_LE(std::abs(radiusError(result.band, 8).mean),
            support::measured(1.19, 1.6) * result.errorEstimate);
}

TEST(CurvatureFlow, AllSchemesAgree) {
  const double time = 12, radius = std::sqrt(144 - 4 * time);
  for (const FlowScheme scheme :
       {FlowScheme::Explicit, FlowScheme::Stabilized, FlowScheme::Implicit}) {
    const CurvatureFlowResult result = curvatureFlow(ball(12), time, {.scheme = scheme});
    EXPECT_EQ(result.scheme, scheme);
    EXPECT_NEAR(radiusError(result.band, radius).mean, 0, support::measured(0.00293))
        << static_cast<int>(scheme);
  }
}

TEST(CurvatureFlow, IsStableForAnyRequestedStep) {
  for (const FlowScheme scheme : {FlowScheme::Stabilized, FlowScheme::Implicit}) {
    const NarrowBand flowed =
        curvatureFlow(ball(16), 30, {.scheme = scheme, .tolerance = 100, .step = 160}).band;
    EXPECT_LE(radiusError(flowed, std::sqrt(256.0 - 120)).worst, support::measured(0.0297));
  }
}

TEST(CurvatureFlow, IsExactInLongSteps) {
  // Errors of long steps in the rates at the band's edge would travel to the surface.
  const double radius = std::sqrt(100.0 * 100 - 4 * 150);
  for (const FlowScheme scheme : {FlowScheme::Stabilized, FlowScheme::Implicit}) {
    const NarrowBand flowed =
        curvatureFlow(ball(100), 150, {.scheme = scheme, .tolerance = 100, .step = 160}).band;
    EXPECT_LE(radiusError(flowed, radius).worst, scheme == FlowScheme::Implicit
                                                     ? support::measured(0.00161)
                                                     : support::measured(0.00118));
  }
}

TEST(CurvatureFlow, ShrinksACylinderByItsSingleCurvature) {
  // Long enough that the ends do not affect its middle.
  const NarrowBand rod = makeCylinder(10, 80, kCentre, V3d(0, 0, 1), 1);
  const NarrowBand flowed = curvatureFlow(rod, 18).band;
  auto accessor = vdb(flowed).getConstAccessor();
  for (const double angle : {0.0, 0.4, 1.1, 2.9, 4.0}) {
    const V3d p = kCentre + V3d(std::cos(angle), std::sin(angle), 0) * 8;
    EXPECT_NEAR(SampleBlock<4>(accessor, toVdb(p)).value(), 0, support::measured(0.00267)) << angle;
  }
}

/// Two balls of radius 12 with a neck of radius 3.
NarrowBand dumbBell() {
  return support::sampleBand(
      [](const V3d& p) {
        const V3d q(std::abs(p.x) - 20, p.y, p.z);
        const double rod = std::max(std::hypot(p.y - 0.3, p.z - 0.2) - 3, std::abs(p.x) - 20);
        return std::min(q.length() - 12, rod);
      },
      {V3d(-33, -13, -13), V3d(33, 13, 13)}, 1);
}

TEST(CurvatureFlow, PinchesADumbBell) {
  const NarrowBand flowed = curvatureFlow(dumbBell(), 8).band;
  const Measurement after = measure(flowed);
  EXPECT_EQ(measure(dumbBell()).components, 1u);
  EXPECT_EQ(after.components, 2u);
  EXPECT_NEAR(after.volume, 2 * 4.0 / 3 * M_PI * std::pow(144 - 32, 1.5),
              support::measured(0.0215) * after.volume);
}

TEST(CurvatureFlow, KeepsThePlateOfOneVoxelFlat) {
  // The plate is curved at its rim only.
  const NarrowBand plate = support::sampleBand(
      [](const V3d& p) {
        const V3d q(std::abs(p.x) - 20, std::abs(p.y) - 20, std::abs(p.z - 0.2) - 0.5);
        return std::max({q.x, q.y, q.z});
      },
      {V3d(-20, -20, -1), V3d(20, 20, 1)}, 1);
  // Compared with redistancing before and after the flow. The interpolant reads across so thin a
  // plate, and each redistancing moves its faces by a tenth of a voxel.
  const NarrowBand still = redistance(redistance(plate)), flowed = curvatureFlow(plate, 1).band;
  auto before = vdb(still).getConstAccessor(), after = vdb(flowed).getConstAccessor();
  for (const int x : {-8, 0, 7})
    for (const int z : {-1, 0, 1}) {
      const openvdb::Coord c(x, 3, z);
      EXPECT_NEAR(after.getValue(c), before.getValue(c), support::rounding(1)) << x << " " << z;
    }
}

TEST(CurvatureFlow, KeepsTheRequestedVolume) {
  // Smooth from the start, because measure() rounds edges and would report changes of them.
  const NarrowBand rod = makeCapsule(kCentre - V3d(12, 0, 0), kCentre + V3d(12, 0, 0), 12, 1);
  const double before = measure(rod).volume;
  const NarrowBand flowed = curvatureFlow(rod, 40, {.preservesVolume = true}).band;
  EXPECT_NEAR(measure(flowed).volume, before, support::measured(1.73e-4) * before);
  EXPECT_LT(measure(flowed).area, 0.99 * measure(rod).area);
}

// While the surface is almost at rest, inner level sets shrink. Without a remedy they would leave a
// cavity where they vanish.
TEST(CurvatureFlow, KeepsOtherLevelSetsFromReachingTheSurface) {
  const NarrowBand rod = makeCapsule(kCentre - V3d(1, 0, 0), kCentre + V3d(1, 0, 0), 12, 1);
  const double before = measure(rod).volume;
  for (const FlowScheme scheme : {FlowScheme::Stabilized, FlowScheme::Implicit}) {
    const NarrowBand flowed =
        curvatureFlow(rod, 60,
                      {.scheme = scheme, .preservesVolume = true, .tolerance = 100, .step = 160})
            .band;
    const Measurement after = measure(flowed);
    EXPECT_EQ(after.surfaces, 1u) << static_cast<int>(scheme);
    EXPECT_NEAR(after.volume, before, support::measured(6.97e-4, 1e-3) * before)
        << static_cast<int>(scheme);
  }
}

TEST(CurvatureFlow, EndsWhenAVolumePreservingFlowIsRound) {
  const NarrowBand rod = makeCapsule(V3d(-10.69, -0.17, 0.43), V3d(13.31, -0.17, 0.43), 10, 1);
  const CurvatureFlowResult rested = curvatureFlow(rod, 1e9, {.preservesVolume = true});
  ASSERT_TRUE(rested.restedAfter.has_value());
  EXPECT_LT(*rested.restedAfter, 1000);
  // A ball has the least area for its volume.
  const Measurement round = measure(rested.band);
  EXPECT_NEAR(round.volume, measure(rod).volume,
              support::measured(3.31e-4) * round.volume);  // 0.01 voxels of radius
  EXPECT_NEAR(round.area, std::cbrt(36 * M_PI * round.volume * round.volume),
              support::measured(2.47e-5) * round.area);
  EXPECT_FALSE(curvatureFlow(rod, 5, {.preservesVolume = true}).restedAfter.has_value());
}

TEST(CurvatureFlow, RefusesEndlessSteps) {
  EXPECT_THROW((void)curvatureFlow(ball(6), 1, {.step = 1e-18}), ResourceLimit);
  EXPECT_THROW((void)curvatureFlow(ball(6), 1, {.preservesVolume = true, .step = 1e-18}),
               ResourceLimit);
}

TEST(CurvatureFlow, KeepsTheSurfaceOutsideTheMask) {
  const Mask right{.field = [](const V3d& p) { return p.x; }, .min = 0, .max = 1};
  const NarrowBand flowed = curvatureFlow(ball(16), 20, {.mask = right}).band;
  auto accessor = vdb(flowed).getConstAccessor();
  const double free = std::sqrt(256.0 - 80);
  EXPECT_NEAR(SampleBlock<4>(accessor, toVdb(kCentre - V3d(16, 0, 0))).value(), 0,
              support::measured(2.19e-5));
  EXPECT_NEAR(SampleBlock<4>(accessor, toVdb(kCentre + V3d(free, 0, 0))).value(), 0,
              support::measured(7.29e-4));
}

TEST(CurvatureFlow, ReportsThatTheSolidVanishes) {
  try {
    (void)curvatureFlow(ball(4), 10);
    FAIL() << "a ball of radius 4 vanishes at time 4";
  } catch (const InvalidInput& error) {
    const std::string sentence = error.what();
    const std::string before = "after a time of ";
    const auto at = sentence.find(before);
    ASSERT_NE(at, std::string::npos) << sentence;
    EXPECT_NEAR(std::stod(sentence.substr(at + before.size())), 4, support::measured(0.826, 1))
        << sentence;
  }
  const NarrowBand needle = makeCylinder(0.7, 12, kCentre, V3d(0, 0, 1), 1);
  EXPECT_THROW((void)curvatureFlow(needle, 5), InvalidInput);
}

TEST(CurvatureFlow, DoesNothingInZeroTime) {
  EXPECT_EQ(curvatureFlow(ball(6), 0).band.contentHash(), ball(6).contentHash());
}

TEST(CurvatureFlow, DoesNotDependOnThreads) {
  std::uint64_t hashes[3];
  for (const std::size_t threads : {1, 2, 4}) {
    hashes[threads / 2] = support::onThreads(threads, [] {
      return curvatureFlow(ball(8), 3, {.preservesVolume = true}).band.contentHash() +
             curvatureFlow(ball(8), 3, {.scheme = FlowScheme::Implicit}).band.contentHash();
    });
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(CurvatureFlow, Refuses) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const NarrowBand b = ball(6);
  EXPECT_THROW((void)curvatureFlow(b, nan), UsageError);
  EXPECT_THROW((void)curvatureFlow(b, -1), UsageError);
  EXPECT_THROW((void)curvatureFlow(b, 1, {.tolerance = 0}), UsageError);
  EXPECT_THROW((void)curvatureFlow(b, 1, {.step = nan}), UsageError);
  EXPECT_THROW((void)curvatureFlow(b, 1, {.mask = Mask{}}), UsageError);
  EXPECT_THROW((void)curvatureFlow(NarrowBand(), 1), InvalidInput);
  EXPECT_THROW((void)curvatureFlow(b, 1, {.maxMemory = 10000}), ResourceLimit);
  EXPECT_THROW((void)curvatureFlow(b, 1, {.progress = [](double) { return false; }}), Cancelled);
}

}  // namespace curvature_flow_test
