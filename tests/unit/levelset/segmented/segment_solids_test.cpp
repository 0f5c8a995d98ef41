// Partitions of solids: owners, distances, reports and refusals.

#include "levelset/segmented/segment_solids.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/segmented/meshing/measure_segmented.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/transform.h"
#include "tests/support/measured.h"
#include "tests/support/segmented.h"
#include "tests/support/threads.h"

namespace segment_solids_test {

using namespace levelset;
using Imath::V3d;
using support::measured;

/// Three overlapping balls.
struct Ball {
  V3d centre;
  double radius;
  [[nodiscard]] double distance(const V3d& p) const { return (p - centre).length() - radius; }
};
const std::vector<Ball> kBalls = {
    {V3d(0.013, 0.021, 0.037), 1}, {V3d(0.613, 0.501, 0.677), 1}, {V3d(0.3, -0.4, 0.9), 0.7}};

std::vector<NarrowBand> ballBands(double voxel, double halfWidth = 3) {
  std::vector<NarrowBand> solids;
  for (const Ball& ball : kBalls)
    solids.push_back(makeSphere(ball.radius, ball.centre, voxel, {.halfWidth = halfWidth}));
  return solids;
}
RegionLabel ownerOf(const V3d& p) {
  for (std::size_t k = kBalls.size(); k-- > 0;)
    if (kBalls[k].distance(p) < 0) return static_cast<RegionLabel>(k + 1);
  return kVoid;
}
/// Distance from the visible surfaces: those that no later ball covers.
double interfaceDistance(const V3d& p) {
  double least = 1e9;
  for (std::size_t k = 0; k < kBalls.size(); ++k) {
    const V3d foot = kBalls[k].centre + (p - kBalls[k].centre).normalized() * kBalls[k].radius;
    bool isVisible = true;
    for (std::size_t j = k + 1; j < kBalls.size(); ++j)
      isVisible = isVisible && kBalls[j].distance(foot) >= 0;
    if (isVisible) least = std::min(least, std::abs(kBalls[k].distance(p)));
  }
  return least;
}

TEST(SegmentSolids, GivesPositionsToTheLastSolid) {
  constexpr double kVoxel = 0.05;
  const SegmentSolidsResult result = segmentSolids(ballBands(kVoxel));
  EXPECT_EQ(result.field.labels(), (std::vector<RegionLabel>{1, 2, 3}));
  EXPECT_TRUE(result.notes.empty());
  EXPECT_TRUE(result.vanished.empty());
  const SegmentedSampler sampler(result.field);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> at(-1.5, 2);
  std::size_t wrong = 0, nearInterfaces = 0;
  for (int n = 0; n < 100000; ++n) {
    const V3d p(at(random), at(random), at(random));
    // Within half a voxel a junction may round the interpolated partition.
    if (interfaceDistance(p) < 0.5 * kVoxel)
      ++nearInterfaces;
    else
      wrong += sampler.label(p) != ownerOf(p);
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_LT(nearInterfaces, 4000u);
  EXPECT_EQ(sampler.label(V3d(NAN)), kVoid);
}

TEST(SegmentSolids, StoresTheDistanceToTheNearestInterface) {
  constexpr double kVoxel = 0.05;
  const SegmentedField field = segmentSolids(ballBands(kVoxel)).field;
  EXPECT_EQ(field.halfWidth(), 2);
  const SegmentedSampler sampler(field);
  // At grid points nothing is interpolated. Positions on the junctions have other nearest points.
  double largest = 0;
  std::size_t far = 0, count = 0;
  for (int i = -25; i <= 40; ++i)
    for (int j = -25; j <= 40; ++j)
      for (int k = -25; k <= 40; ++k) {
        const V3d p = V3d(i, j, k) * kVoxel;
        const double exact = interfaceDistance(p);
        if (exact > 1.9 * kVoxel) continue;
        largest = std::max(largest, std::abs(sampler.distance(p) - exact));
        EXPECT_NEAR(sampler.signedDistance(p, ownerOf(p)), -sampler.distance(p), 1e-12);
        far += std::abs(sampler.distance(p) - exact) > 1e-6;
        ++count;
      }
  // Near a junction, a distance within the gap of the smallest one may be stored: 0.01 voxels.
  EXPECT_LT(largest, measured(4.9e-4, 0.01 * kVoxel));
  EXPECT_LT(double(far) / double(count), measured(0.00046));
}

TEST(SegmentSolids, TakesLabelsAndReportsWhatVanishes) {
  std::vector<NarrowBand> solids = ballBands(0.1);
  solids.insert(solids.begin(), makeSphere(0.3, kBalls[2].centre, 0.1));  // inside the last ball
  const SegmentSolidsResult result = segmentSolids(solids, {.labels = {9, 65535, 7, 40}});
  EXPECT_EQ(result.field.labels(), (std::vector<RegionLabel>{7, 40, 65535}));
  EXPECT_EQ(result.vanished, (std::vector<RegionLabel>{9}));
  EXPECT_EQ(SegmentedSampler(result.field).label(kBalls[2].centre), 40);
}

TEST(SegmentSolids, ReportsThinParts) {
  constexpr double kVoxel = 0.1;
  // A layer of 0.4 voxels between two balls: most grid lines cross it without a grid point.
  const std::vector<NarrowBand> solids = {makeSphere(1, V3d(0.01), kVoxel),
                                          makeSphere(0.96, V3d(0.01), kVoxel)};
  const SegmentSolidsResult result = segmentSolids(solids);
  ASSERT_EQ(result.thinParts.size(), 1u);
  const ThinPart& part = result.thinParts[0];
  EXPECT_EQ(part.label, 1);
  EXPECT_TRUE(part.isLost);
  EXPECT_GT(part.places, 500u);
  EXPECT_GT(part.thickness, 0.02);
  EXPECT_LT(part.thickness, 0.041);
  EXPECT_NEAR((part.position - V3d(0.01)).length(), 0.98, 0.02);
  // Regions that end at a junction do not count.
  EXPECT_TRUE(segmentSolids(ballBands(0.05)).thinParts.empty());
}

TEST(SegmentSolids, ClosesGapsBetweenTouchingFaces) {
  // Faces on grid points, and between them; the second pair has a gap of a thousandth of a voxel.
  for (const double shift : {0.0, 0.031}) {
    const V3d centre(0.5 + shift);
    const std::vector<NarrowBand> boxes = {
        makeBox(V3d(1), centre, 0.1), makeBox(V3d(1), centre + V3d(1 + shift * 0.003, 0, 0), 0.1)};
    const SegmentSolidsResult result = segmentSolids(boxes);
    EXPECT_TRUE(result.thinParts.empty()) << shift;
    const SegmentedMeasurement measured = measureSegmented(result.field);
    ASSERT_EQ(measured.interfaces.size(), 3u);
    EXPECT_EQ(measured.interfaces[2].sides, (TriangleSides{2, 1}));
    EXPECT_NEAR(measured.interfaces[2].area, 1, support::measured(0.0627)) << shift;
  }
}

TEST(SegmentSolids, ResamplesToTheFinestGrid) {
  std::vector<NarrowBand> solids = ballBands(0.05);
  solids[0] = makeSphere(kBalls[0].radius, kBalls[0].centre, 0.07);
  // A ball on a turned grid.
  const V3d centre = kBalls[1].centre;
  solids[1] = transform(solids[1], Imath::M44d().setTranslation(-centre) *
                                       Imath::M44d().setEulerAngles(V3d(0.1, 0.2, 0.3)) *
                                       Imath::M44d().setTranslation(centre));
  const SegmentSolidsResult result = segmentSolids(solids);
  EXPECT_GE(result.notes.size(), 1u);
  EXPECT_NEAR(result.field.voxelSize(), 0.05, 1e-9);
  const SegmentedMeasurement one = measureSegmented(segmentSolids(ballBands(0.05)).field),
                             other = measureSegmented(result.field);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(other.regions[k].volume, one.regions[k].volume, measured(1e-4));
}

TEST(SegmentSolids, WidensNarrowBands) {
  const SegmentSolidsResult result = segmentSolids(ballBands(0.1, 1));
  ASSERT_EQ(result.notes.size(), 3u);
  EXPECT_EQ(result.notes[0], "operand 1 was widened from a half width of 1 to 2 voxels");
}

TEST(SegmentSolids, HasTheSameBitsWithAnyNumberOfThreads) {
  const std::vector<NarrowBand> solids = ballBands(0.05);
  const auto run = [&](std::size_t threads) {
    return support::onThreads(threads, [&] {
      const SegmentedField field = segmentSolids(solids).field;
      const SegmentedMesh mesh = segmentedToMesh(field);
      return std::make_tuple(field.contentHash(), mesh.mesh.positions, mesh.mesh.triangles);
    });
  };
  EXPECT_EQ(run(1), run(4));
}

TEST(SegmentSolids, KeepsDigitsFarFromTheOrigin) {
  constexpr double kVoxel = 0.05, kFar = 1e6;
  const V3d shift(kFar, -kFar, kFar);
  std::vector<NarrowBand> solids;
  for (const Ball& ball : kBalls)
    solids.push_back(makeSphere(ball.radius, ball.centre + shift, kVoxel));
  const SegmentedMeasurement far = measureSegmented(segmentSolids(solids).field),
                             near = measureSegmented(segmentSolids(ballBands(kVoxel)).field);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(far.regions[k].volume, near.regions[k].volume, measured(1.8e-6));
    EXPECT_NEAR(far.regions[k].area, near.regions[k].area, measured(1.8e-4));
  }
}

TEST(SegmentSolids, TakesLessMemoryThanSeparateBands) {
  const std::vector<NarrowBand> solids = ballBands(0.02);
  std::size_t separate = solids.back().memoryUse();
  for (std::size_t k = 0; k + 1 < solids.size(); ++k)
    separate += combine(CsgOperation::Difference, std::span(solids).subspan(k)).band.memoryUse();
  EXPECT_LT(double(segmentSolids(solids).field.memoryUse()) / double(separate), measured(0.346));
}

TEST(SegmentSolids, Refuses) {
  const std::vector<NarrowBand> solids = ballBands(0.1);
  const auto refuse = [&](const SegmentSolidsOptions& options) {
    (void)segmentSolids(solids, options);
  };
  EXPECT_THROW((void)segmentSolids({}), UsageError);
  EXPECT_THROW((void)segmentSolids(std::array{solids[0], NarrowBand()}), InvalidInput);
  EXPECT_THROW(refuse({.halfWidth = 1.9}), UsageError);
  EXPECT_THROW(refuse({.halfWidth = NAN}), UsageError);
  EXPECT_THROW(refuse({.labels = {1, 2}}), UsageError);
  EXPECT_THROW(refuse({.labels = {1, 2, 1}}), UsageError);
  EXPECT_THROW(refuse({.labels = {1, 0, 2}}), UsageError);
  EXPECT_THROW(refuse({.gap = -0.1}), UsageError);
  EXPECT_THROW(refuse({.gap = 0.6}), UsageError);
  EXPECT_THROW(refuse({.maxMemory = 1000}), ResourceLimit);
  EXPECT_THROW(refuse({.progress = [](double) { return false; }}), Cancelled);
}

}  // namespace segment_solids_test
