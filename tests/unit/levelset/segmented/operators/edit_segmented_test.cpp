// Solids that are added to partitions or cut out of them, and new labels.

#include "levelset/segmented/operators/edit_segmented.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "levelset/error.h"
#include "levelset/segmented/meshing/measure_segmented.h"
#include "levelset/segmented/operators/offset_region.h"
#include "levelset/segmented/segment_solids.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/measured.h"
#include "tests/support/segmented.h"
#include "tests/support/threads.h"

namespace edit_segmented_test {

using namespace levelset;
using Imath::V3d;
using std::numbers::pi;
using support::interfaceDefects;
using support::InterfaceDefects;
using support::measured;
using support::measuredOrder;

constexpr double kVoxel = 0.05;
const V3d kFirst(0.013, 0.021, 0.037), kAxis(0.6, 0.48, 0.64);
constexpr double kBall = 4 * pi / 3;
/// Volume of the intersection of two balls of radius 1 whose centres are 1 apart.
constexpr double kLens = 5 * pi / 12;

NarrowBand first(double voxel = kVoxel) {
  return makeSphere(1, kFirst, voxel);
}
NarrowBand second(double voxel = kVoxel) {
  return makeSphere(1, kFirst + kAxis, voxel);
}
/// Away from the first ball, and beside the second one.
NarrowBand third() {
  return makeSphere(0.5, kFirst + kAxis * 2.2, kVoxel);
}
SegmentedField of(const std::vector<NarrowBand>& solids) {
  return segmentSolids(solids).field;
}
/// Largest difference of the distances to the nearest interface, voxels, at grid points up to one
/// voxel from it. 1e9 where the owners differ farther than 1e-6 voxels from an interface.
double largestDifference(const SegmentedField& a, const SegmentedField& b) {
  const SegmentedSampler u(a), v(b);
  double largest = 0;
  for (int x = -24; x < 64; ++x)
    for (int y = -24; y < 56; ++y)
      for (int z = -24; z < 56; ++z) {
        const V3d p = V3d(x, y, z) * kVoxel;
        const double s = u.distance(p), t = v.distance(p);
        if (std::min(s, t) > kVoxel) continue;
        if (std::min(s, t) > 1e-6 * kVoxel && u.label(p) != v.label(p)) return 1e9;
        largest = std::max(largest, std::abs(s - t) / kVoxel);
      }
  return largest;
}

TEST(AddSolid, GivesThePartitionOfTheSolids) {
  const SegmentedField expected = of({first(), second(), third()}),
                       field = addSolid(addSolid(of({first()}), second(), 2), third(), 3);
  // Solids that are 0.01 voxels apart count as touching, so distances may differ by that.
  EXPECT_LT(largestDifference(field, expected), measured(0.0073, 0.01));
  const SegmentedMesh mesh = segmentedToMesh(field);
  EXPECT_EQ(interfaceDefects(mesh), InterfaceDefects());
  const SegmentedMeasurement one = measureSegmented(mesh), other = measureSegmented(expected);
  for (std::size_t k = 1; k < 4; ++k)
    EXPECT_NEAR(one.regions[k].volume, other.regions[k].volume, measured(5.5e-5));
}

TEST(AddSolid, TakesFromTheVoidOnly) {
  std::vector<double> errors;
  for (const double voxel : {0.1, 0.05}) {
    const SegmentedField field =
        addSolid(of({first(voxel)}), second(voxel), 2, {.over = std::vector<RegionLabel>{kVoid}});
    const SegmentedMesh mesh = segmentedToMesh(field);
    EXPECT_EQ(interfaceDefects(mesh), InterfaceDefects());
    const SegmentedMeasurement m = measureSegmented(mesh);
    errors.push_back(std::max(std::abs(m.regions[1].volume - kBall),
                              std::abs(m.regions[2].volume - (kBall - kLens))));
  }
  EXPECT_LT(errors[1], measured(5.1e-3));
  EXPECT_GT(std::log2(errors[0] / errors[1]), measuredOrder(2));
  // The order of solids that do not cover each other does not matter.
  const SegmentedField other = addSolid(of({second()}), first(), 7);
  const SegmentedField same =
      addSolid(of({first()}), second(), 9, {.over = std::vector<RegionLabel>{kVoid}});
  const SegmentedField renamed = relabel(other, {{7, 1}, {1, 9}});
  EXPECT_LT(largestDifference(same, renamed), 1e-9);
}

TEST(AddSolid, ExtendsARegion) {
  // The union of both balls, in two ways.
  const SegmentedField field = addSolid(of({first()}), second(), 1);
  EXPECT_EQ(field.labels(), (std::vector<RegionLabel>{1}));
  const SegmentedMeasurement m = measureSegmented(field);
  EXPECT_NEAR(m.volume, 2 * kBall - kLens, measured(5.8e-3));
  const SegmentedMeasurement merged = measureSegmented(relabel(of({first(), second()}), {{2, 1}}));
  ASSERT_EQ(merged.interfaces.size(), 1u);
  EXPECT_NEAR(merged.volume, 2 * kBall - kLens, measured(6e-3));
  EXPECT_NEAR(merged.area, m.area, measured(0.0131));
}

TEST(Cut, RemovesASolid) {
  const SegmentedField field = of({first(), third()}), rest = cut(field, second());
  const SegmentedMeasurement m = measureSegmented(rest);
  EXPECT_NEAR(m.regions[1].volume, kBall - kLens, measured(5.1e-3));
  // The third ball sticks out of the second one.
  const SegmentedMeasurement only =
      measureSegmented(cut(field, second(), {.over = std::vector<RegionLabel>{2}}));
  EXPECT_NEAR(only.regions[1].volume, measureSegmented(field).regions[1].volume, measured(1e-9));
  EXPECT_NEAR(only.regions[2].volume, m.regions[2].volume, measured(1e-9));
  // Adding and cutting a solid gives its space to the void.
  const SegmentedField twice = cut(addSolid(field, second(), 5), second());
  EXPECT_EQ(twice.labels(), rest.labels());
  // The owners are the same. Near former junctions the ball hid distances to other interfaces.
  EXPECT_LT(largestDifference(twice, rest), measured(0.97, 1));
  EXPECT_THROW((void)cut(of({first()}), makeSphere(1.5, kFirst, kVoxel)), NoSurface);
}

TEST(Relabel, MergesAndRemovesRegions) {
  const SegmentedField field = of({first(), second(), third()});
  const SegmentedMeasurement before = measureSegmented(field);
  const SegmentedField merged = relabel(field, {{1, 3}});
  const SegmentedMesh mesh = segmentedToMesh(merged);
  EXPECT_EQ(interfaceDefects(mesh), InterfaceDefects());
  const SegmentedMeasurement m = measureSegmented(mesh);
  EXPECT_EQ(merged.labels(), (std::vector<RegionLabel>{2, 3}));
  EXPECT_NEAR(m.volume, before.volume, measured(4.8e-6));
  EXPECT_NEAR(m.regions[2].volume, before.regions[1].volume + before.regions[3].volume,
              measured(9.6e-5));
  // A swap is its own inverse.
  const SegmentedField swapped = relabel(field, {{1, 2}, {2, 1}});
  EXPECT_LT(largestDifference(relabel(swapped, {{1, 2}, {2, 1}}), field), measured(0.0087, 0.01));
  EXPECT_EQ(relabel(field, {}).contentHash(), field.contentHash());
  // A region without neighbours is removed as if it had never been there.
  const SegmentedField apart = of({first(), makeSphere(0.5, V3d(3, 0, 0), kVoxel)});
  EXPECT_EQ(relabel(apart, {{2, kVoid}}).contentHash(), of({first()}).contentHash());
  EXPECT_THROW((void)relabel(of({first()}), {{1, kVoid}}), NoSurface);
}

TEST(EditSegmented, HasTheSameBitsWithAnyNumberOfThreads) {
  const SegmentedField field = of({first(0.1), second(0.1)});
  const auto run = [&](std::size_t threads) {
    return support::onThreads(threads, [&] {
      const SegmentedField edited = relabel(cut(field, makeSphere(0.4, V3d(1), 0.1)), {{1, 2}});
      return offsetRegion(edited, 2, -0.1).contentHash();
    });
  };
  EXPECT_EQ(run(1), run(2));
}

TEST(EditSegmented, Refuses) {
  const SegmentedField field = of({first()});
  EXPECT_THROW((void)addSolid(field, second(), 0), UsageError);
  EXPECT_THROW((void)addSolid(field, second(), 2, {.over = std::vector<RegionLabel>{4}}),
               UsageError);
  EXPECT_THROW((void)addSolid(field, second(), 2, {.gap = 0.6}), UsageError);
  EXPECT_THROW((void)addSolid(field, NarrowBand(), 2), InvalidInput);
  EXPECT_THROW((void)addSolid(SegmentedField(), second(), 2), InvalidInput);
  EXPECT_THROW((void)addSolid(field, second(), 2, {.maxMemory = 1000}), ResourceLimit);
  EXPECT_THROW((void)relabel(field, {{0, 1}}), UsageError);
  EXPECT_THROW((void)relabel(field, {{2, 1}}), UsageError);
}

/// A ball inside a larger one.
constexpr double kInner = 0.6;
SegmentedField nested(double voxel) {
  return of({makeSphere(1, kFirst, voxel), makeSphere(kInner, kFirst, voxel)});
}
double ballVolume(double radius) {
  return kBall * radius * radius * radius;
}

TEST(OffsetRegion, GrowsBallsAtTheCostOfNeighbours) {
  std::vector<double> errors;
  for (const double voxel : {0.1, 0.05}) {
    const SegmentedField field = offsetRegion(nested(voxel), 2, 0.17);
    const SegmentedMeasurement m = measureSegmented(field);
    errors.push_back(std::max(std::abs(m.regions[2].volume - ballVolume(kInner + 0.17)),
                              std::abs(m.volume - kBall)));
  }
  EXPECT_LT(errors[1], measured(5.3e-3));
  EXPECT_GT(std::log2(errors[0] / errors[1]), measuredOrder(2));
}

TEST(OffsetRegion, GrowsIntoTheVoidOnly) {
  // The outer region grows, and the inner one stays.
  const SegmentedMeasurement m =
      measureSegmented(offsetRegion(nested(kVoxel), 1, 0.17, {.cost = OffsetCost::Void}));
  EXPECT_NEAR(m.regions[2].volume, ballVolume(kInner), measured(3.2e-3));
  EXPECT_NEAR(m.volume, ballVolume(1.17), measured(6.2e-3));
  // At the cost of all neighbours it takes from both sides.
  const SegmentedMeasurement both = measureSegmented(offsetRegion(nested(kVoxel), 1, 0.17));
  EXPECT_NEAR(both.regions[2].volume, ballVolume(kInner - 0.17), measured(2.3e-3));
  EXPECT_NEAR(both.volume, ballVolume(1.17), measured(6.2e-3));
}

TEST(OffsetRegion, ShrinksIntoTheVoidOrTheNearestNeighbour) {
  const SegmentedMeasurement gap =
      measureSegmented(offsetRegion(nested(kVoxel), 2, -0.17, {.cost = OffsetCost::Void}));
  EXPECT_NEAR(gap.regions[2].volume, ballVolume(kInner - 0.17), measured(2.3e-3));
  EXPECT_NEAR(gap.regions[1].volume, kBall - ballVolume(kInner), measured(2.1e-3));
  const SegmentedMesh mesh = segmentedToMesh(offsetRegion(nested(kVoxel), 1, -0.1));
  EXPECT_EQ(interfaceDefects(mesh), InterfaceDefects());
  const SegmentedMeasurement shell = measureSegmented(mesh);
  EXPECT_NEAR(shell.regions[1].volume, ballVolume(0.9) - ballVolume(kInner + 0.1),
              measured(1.1e-3));
  EXPECT_NEAR(shell.regions[2].volume, ballVolume(kInner + 0.1), measured(3.7e-3));
  // A shell that shrinks to nothing is divided half way between both sides.
  const SegmentedField none = offsetRegion(nested(kVoxel), 1, -0.3);
  EXPECT_EQ(none.labels(), (std::vector<RegionLabel>{2}));
  EXPECT_NEAR(measureSegmented(none).volume, ballVolume((1 + kInner) / 2), measured(4.2e-3));
  EXPECT_THROW((void)offsetRegion(of({first()}), 1, -1.1), NoSurface);
}

TEST(OffsetRegion, KeepsTheBitsOfOtherInterfaces) {
  // Two layers, and a ball far from the first one.
  const SegmentedField field = of({makeBox(V3d(2, 2, 1), V3d(0.011, 0.007, 0.013), kVoxel),
                                   makeBox(V3d(2, 2, 1), V3d(0.011, 0.007, 1.013), kVoxel),
                                   makeSphere(0.5, V3d(4, 0, 0), kVoxel)});
  for (const double distance : {0.1, -0.1}) {
    const SegmentedField moved = offsetRegion(field, 1, distance);
    const SegmentedSampler before(field), after(moved);
    std::size_t changed = 0, count = 0;
    for (double x = 3; x < 5; x += 0.03)
      for (double y = -1; y < 1; y += 0.03) {
        const V3d p(x, y, 0.1);
        changed += before.signedDistance(p, 3) != after.signedDistance(p, 3);
        ++count;
      }
    EXPECT_EQ(changed, 0u);
    EXPECT_GT(count, 1000u);
    // The top of the second layer, over its middle.
    EXPECT_EQ(before.signedDistance(V3d(0.3, 0.2, 1.5), 2),
              after.signedDistance(V3d(0.3, 0.2, 1.5), 2));
    // The face between the layers, where they meet.
    EXPECT_NEAR(after.signedDistance(V3d(0.3, 0.2, 0.513 + distance), 2), 0, measured(1e-7));
  }
}

TEST(OffsetRegion, Refuses) {
  const SegmentedField field = of({first()});
  EXPECT_THROW((void)offsetRegion(field, 0, 0.1), UsageError);
  EXPECT_THROW((void)offsetRegion(field, 2, 0.1), UsageError);
  EXPECT_THROW((void)offsetRegion(field, 1, NAN), UsageError);
  EXPECT_EQ(offsetRegion(field, 1, 0).contentHash(), field.contentHash());
}

}  // namespace edit_segmented_test
