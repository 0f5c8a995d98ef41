// Morphs between partitions.

#include "levelset/segmented/operators/morph_segmented.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/segmented/meshing/measure_segmented.h"
#include "levelset/segmented/segment_solids.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/measured.h"
#include "tests/support/segmented.h"
#include "tests/support/threads.h"

namespace morph_segmented_test {

using namespace levelset;
using Imath::V3d;
using std::numbers::pi;
using support::interfaceDefects;
using support::InterfaceDefects;
using support::measured;
using support::measuredOrder;

const V3d kCentre(0.013, 0.021, 0.037);

SegmentedField of(const std::vector<NarrowBand>& solids) {
  return segmentSolids(solids).field;
}
double ballVolume(double radius) {
  return 4 * pi / 3 * radius * radius * radius;
}

/// Largest distance of the interfaces from spheres.
/// @param radii  by the label behind the interface, from 1
double radiusError(const SegmentedField& field, const std::vector<double>& radii) {
  const SegmentedMesh mesh = segmentedToMesh(field);
  EXPECT_EQ(interfaceDefects(mesh), InterfaceDefects());
  double worst = 0;
  for (std::size_t t = 0; t < mesh.sides.size(); ++t)
    for (const std::uint32_t v : mesh.mesh.triangles[t])
      worst = std::max(worst, std::abs((mesh.mesh.positions[v] - kCentre).length() -
                                       radii[mesh.sides[t].behind - 1u]));
  return worst;
}

TEST(MorphSegmented, AveragesTheRadiiOfBalls) {
  std::vector<double> one, two;
  for (const double voxel : {0.25, 0.125}) {
    const auto ball = [&](double radius) { return makeSphere(radius, kCentre, voxel); };
    one.push_back(radiusError(morphSegmented(of({ball(1)}), of({ball(2)}), 0.5), {1.5}));
    // With a layer between the two spheres, its distance is that to the nearer one. The mean
    // distances balance at 1.4 and 0.95.
    two.push_back(radiusError(
        morphSegmented(of({ball(1), ball(0.5)}), of({ball(2), ball(1.2)}), 0.5), {1.4, 0.95}));
  }
  EXPECT_LT(one[1], measured(3.9e-3));
  EXPECT_LT(two[1], measured(6.1e-3));
  EXPECT_GT(std::log2(one[0] / one[1]), measuredOrder(2));
}

TEST(MorphSegmented, ClosesHolesAndJoinsBlobs) {
  constexpr double kVoxel = 0.2;
  const SegmentedField ring = of({makeTorus(1, 0.4, V3d(0.01), V3d(0, 0, 1), kVoxel)}),
                       ball = of({makeSphere(1.4, V3d(0.01), kVoxel)});
  const auto topology = [](const SegmentedField& field) {
    return measure(regionSurface(field, 1));
  };
  EXPECT_EQ(topology(morphSegmented(ring, ball, 0.1)).euler, 0);
  EXPECT_EQ(topology(morphSegmented(ring, ball, 0.9)).euler, 2);
  const SegmentedField two = of({unite(makeSphere(0.6, V3d(-1, 0, 0), kVoxel),
                                       makeSphere(0.6, V3d(1, 0, 0), kVoxel))}),
                       one = of({makeSphere(1, V3d(0), kVoxel)});
  EXPECT_EQ(topology(morphSegmented(two, one, 0.1)).components, 2u);
  EXPECT_EQ(topology(morphSegmented(two, one, 0.9)).components, 1u);
}

TEST(MorphSegmented, KeepsPartitionsClosed) {
  constexpr double kVoxel = 0.2;
  const SegmentedField from =
                           of(support::ballSectors(support::turnedFrame(kCentre, 0.7), 1, kVoxel)),
                       to = of(support::ballSectors(support::turnedFrame(kCentre, 1.1), 1, kVoxel));
  const SegmentedMesh mesh = segmentedToMesh(morphSegmented(from, to, 0.5));
  EXPECT_EQ(interfaceDefects(mesh), InterfaceDefects());
  const SegmentedMeasurement m = measureSegmented(mesh);
  // The ball stays, and the sectors are congruent.
  EXPECT_NEAR(m.volume, ballVolume(1), measured(0.2291));
  // The ends are the operands.
  EXPECT_EQ(morphSegmented(from, to, 0).contentHash(), from.contentHash());
  const SegmentedMeasurement end = measureSegmented(morphSegmented(from, to, 1)),
                             target = measureSegmented(to);
  for (std::size_t k = 1; k < 4; ++k)
    EXPECT_NEAR(end.regions[k].volume, target.regions[k].volume, measured(0.0503));
  // A region that only one partition has grows from its middle.
  const SegmentedField more =
                           of({makeSphere(1, kCentre, kVoxel), makeSphere(0.6, kCentre, kVoxel)}),
                       less = of({makeSphere(1, kCentre, kVoxel)});
  EXPECT_EQ(morphSegmented(less, more, 0.05).labels(), (std::vector<RegionLabel>{1}));
  EXPECT_EQ(morphSegmented(less, more, 0.95).labels(), (std::vector<RegionLabel>{1, 2}));
}

TEST(MorphSegmented, HasTheSameBitsWithAnyNumberOfThreads) {
  const SegmentedField from = of({makeSphere(1, kCentre, 0.2)}),
                       to = of({makeSphere(1.5, kCentre, 0.2), makeSphere(0.5, kCentre, 0.2)});
  const auto run = [&](std::size_t threads) {
    return support::onThreads(threads, [&] { return morphSegmented(from, to, 0.7).contentHash(); });
  };
  EXPECT_EQ(run(1), run(2));
}

TEST(MorphSegmented, Refuses) {
  const SegmentedField field = of({makeSphere(1, kCentre, 0.2)});
  EXPECT_THROW((void)morphSegmented(field, field, -0.1), UsageError);
  EXPECT_THROW((void)morphSegmented(field, field, NAN), UsageError);
  EXPECT_THROW((void)morphSegmented(field, SegmentedField(), 0.5), InvalidInput);
  EXPECT_THROW((void)morphSegmented(field, of({makeSphere(1, V3d(5, 0, 0), 0.2)}), 0.5), NoSurface);
}

}  // namespace morph_segmented_test
