// Exact placement of partitions.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "levelset/segmented/meshing/measure_segmented.h"
#include "levelset/segmented/place_segmented.h"
#include "levelset/segmented/segmented_data_vdb.h"
#include "levelset/segmented/sources/segment_mesh.h"
#include "tests/support/files.h"
#include "tests/support/segmented_scenes.h"
#include "tests/support/sheet_meshes.h"

namespace place_segmented_test {

using namespace levelset;
using Imath::M44d;
using Imath::V3d;

M44d similarity(double scale) {
  M44d turn, size, move;
  turn.setAxisAngle(V3d(1, 2, -1).normalized(), 0.7);
  size.setScale(V3d(scale));
  move.setTranslation(V3d(3, -2, 0.5));
  return turn * size * move;
}

TEST(PlaceSegmented, MovesLabelsDistancesAndMeasures) {
  const SegmentedField field = support::threeBalls(0.1);
  const SegmentedMeasurement before = measureSegmented(segmentedToMesh(field));
  for (const double scale : {1.0, 0.3, 1000.0}) {
    SCOPED_TRACE(scale);
    const M44d matrix = similarity(scale);
    const SegmentedField moved = placeSegmented(field, matrix);
    EXPECT_NEAR(moved.voxelSize(), scale * field.voxelSize(), 1e-12 * scale);
    EXPECT_EQ(moved.halfWidth(), field.halfWidth());
    EXPECT_EQ(moved.activeVoxelCount(), field.activeVoxelCount());
    const SegmentedSampler from(field), to(moved);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> place(-1.2, 1.7);
    for (int n = 0; n < 2000; ++n) {
      const V3d p(place(random), place(random), place(random));
      // Near interfaces rounding decides on the label.
      if (from.distance(p) > 1e-6) {
        EXPECT_EQ(to.label(p * matrix), from.label(p));
      }
      for (const RegionLabel label : field.labels())
        EXPECT_NEAR(to.signedDistance(p * matrix, label) / scale, from.signedDistance(p, label),
                    2e-7);
    }
    const SegmentedMeasurement after = measureSegmented(segmentedToMesh(moved));
    ASSERT_EQ(after.regions.size(), before.regions.size());
    for (std::size_t r = 0; r < after.regions.size(); ++r)
      EXPECT_NEAR(after.regions[r].volume / std::pow(scale, 3), before.regions[r].volume, 1e-5);
    EXPECT_NEAR(after.junctionLength / scale, before.junctionLength, 1e-5);
  }
}

TEST(PlaceSegmented, KeepsTheBitsOfDistancesUnderRotation) {
  const SegmentedField field = support::threeBalls(0.1);
  const SegmentedField back =
      placeSegmented(placeSegmented(field, similarity(1)), similarity(1).inverse());
  EXPECT_GT(field.shared()->distances.size(), 1000u);
  EXPECT_EQ(back.shared()->distances, field.shared()->distances);
  EXPECT_EQ(placeSegmented(field, M44d()).contentHash(), field.contentHash());
}

TEST(PlaceSegmented, MovesSheets) {
  const support::Frame frame = support::tiltedFrame(V3d(0.013, 0.021, 0.037), 15);
  const SegmentedField field =
      segmentMesh(support::moebiusMesh(0.4, frame), 0.1, {.keepsSheets = true}).field;
  const SegmentedField moved = placeSegmented(field, similarity(2));
  EXPECT_EQ(moved.sheetLabels(), field.sheetLabels());
  const SegmentedMeasurement before = measureSegmented(segmentedToMesh(field)),
                             after = measureSegmented(segmentedToMesh(moved));
  EXPECT_GT(before.rimLength, 1);
  EXPECT_NEAR(after.rimLength, 2 * before.rimLength, 1e-6 * before.rimLength);
}

TEST(PlaceSegmented, RefusesWhatAGridTransformCannotHold) {
  const SegmentedField field = support::nestedBalls(1, 0.6, 0.2);
  M44d uneven, mirror, singular, far;
  uneven.setScale(V3d(1, 2, 1));
  mirror.setScale(V3d(-1, 1, 1));
  singular.setScale(V3d(1, 0, 1));
  far.setTranslation(V3d(1e15, 0, 0));
  EXPECT_SAYS(support::refusal<InvalidInput>([&] { (void)placeSegmented(field, uneven); }),
              "before 'segment'");
  EXPECT_SAYS(support::refusal<InvalidInput>([&] { (void)placeSegmented(field, mirror); }),
              "before 'segment'");
  EXPECT_SAYS(support::refusal<UsageError>([&] { (void)placeSegmented(field, singular); }),
              "singular");
  EXPECT_SAYS(support::refusal<InvalidInput>([&] { (void)placeSegmented(field, far); }),
              "too coarse");
  EXPECT_SAYS(support::refusal<InvalidInput>([&] { (void)placeSegmented({}, M44d()); }), "empty");
}

}  // namespace place_segmented_test
