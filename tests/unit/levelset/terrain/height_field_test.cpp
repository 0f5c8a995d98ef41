#include "levelset/terrain/height_field.h"

#include <gtest/gtest.h>

#include <cmath>

#include "levelset/error.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/terrains.h"

namespace height_field_test {

using Imath::Box3d;
using Imath::V2d;
using Imath::V3d;
using levelset::HeightField;
using levelset::InvalidInput;
using support::refusal;

/// Four columns and three rows; the height is 10 × row + column.
HeightField ramp() {
  HeightField field{.columns = 4, .rows = 3, .origin = {100, 200}, .spacing = {2, 5}};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      field.heights.push_back(static_cast<float>(10 * row + column));
  return field;
}

TEST(HeightField, HasThePlaceOfItsKnownSamples) {
  HeightField field = ramp();
  EXPECT_EQ(field.point(3, 2), V3d(106, 210, 23));
  EXPECT_EQ(field.missingCount(), 0u);
  EXPECT_EQ(field.bounds().min, V3d(100, 200, 0));
  EXPECT_EQ(field.bounds().max, V3d(106, 210, 23));
  for (int column = 0; column < 4; ++column)
    field.heights[field.index(column, 2)] = levelset::kMissingHeight;
  field.heights[0] = levelset::kMissingHeight;
  EXPECT_EQ(field.missingCount(), 5u);
  EXPECT_EQ(field.bounds().min, V3d(100, 200, 1));
  EXPECT_EQ(field.bounds().max, V3d(106, 205, 13));
  field.heights.assign(12, levelset::kMissingHeight);
  EXPECT_TRUE(field.bounds().isEmpty());
}

TEST(HeightField, HashesWhatDiffers) {
  const HeightField field = ramp();
  EXPECT_EQ(field.contentHash(), ramp().contentHash());
  HeightField other = ramp();
  other.heights[5] += 1;
  EXPECT_NE(other.contentHash(), field.contentHash());
  other = ramp();
  other.origin.y += 1;
  EXPECT_NE(other.contentHash(), field.contentHash());
  HeightField one = ramp(), two = ramp();
  one.heights[3] = levelset::kMissingHeight;
  two.heights[3] = -levelset::kMissingHeight;  // another NaN
  EXPECT_EQ(one.contentHash(), two.contentHash());
}

TEST(HeightField, RefusesWhatIsNoField) {
  const auto refused = [](const auto& change) {
    HeightField field = ramp();
    change(field);
    return refusal<InvalidInput>([&] { levelset::requireHeights(field); });
  };
  EXPECT_SAYS(refused([](HeightField& f) { f.columns = 0; }), "0 columns and 3 rows");
  EXPECT_SAYS(refused([](HeightField& f) { f.heights.pop_back(); }), "11 heights");
  EXPECT_SAYS(refused([](HeightField& f) { f.spacing.x = 0; }), "must be positive");
  EXPECT_SAYS(refused([](HeightField& f) { f.spacing.y = NAN; }), "must be positive");
  EXPECT_SAYS(refused([](HeightField& f) { f.origin.x = HUGE_VAL; }), "is not finite");
  EXPECT_SAYS(refused([](HeightField& f) {
                f.spacing.x = 1e308;
                f.origin.x = 1e308;
              }),
              "is not finite");
  EXPECT_SAYS(refused([](HeightField& f) { f.heights[6] = HUGE_VALF; }), "column 2 and row 1");
  EXPECT_NO_THROW(levelset::requireHeights(ramp()));
  EXPECT_NO_THROW(levelset::requireHeights({.columns = 1, .rows = 1, .heights = {3}}));
}

TEST(HeightField, CropKeepsTheSamplesOfABox) {
  const HeightField part =
      levelset::croppedHeights(ramp(), Box3d(V3d(101, 200, -1), V3d(104, 205, 1)));
  EXPECT_EQ(part.columns, 2);
  EXPECT_EQ(part.rows, 2);
  EXPECT_EQ(part.origin, V2d(102, 200));
  EXPECT_EQ(part.heights, (std::vector<float>{1, 2, 11, 12}));
  const HeightField all =
      levelset::croppedHeights(ramp(), Box3d(V3d(-1e30, -1e30, 0), V3d(1e30, 1e30, 0)));
  EXPECT_EQ(all.contentHash(), ramp().contentHash());
  EXPECT_SAYS(refusal<InvalidInput>([] {
                static_cast<void>(
                    levelset::croppedHeights(ramp(), Box3d(V3d(102.5, 0, 0), V3d(103, 999, 1))));
              }),
              "has no sample of the terrain");
}

TEST(HeightField, TurnsDegreesIntoMetres) {
  // Lengths of a degree on the ellipsoid of WGS 84, metres.
  const struct {
    double latitude, east, north;
  } facts[] = {{0, 111319.491, 110574.276}, {45, 78846.835, 111131.777}};
  for (const auto& fact : facts) {
    HeightField field{.columns = 3,
                      .rows = 3,
                      .origin = {9.75, fact.latitude - 0.25},
                      .spacing = {0.25, 0.25},
                      .heights = std::vector<float>(9, 1),
                      .coordinateSystem = "WGS 84",
                      .isGeographic = true};
    EXPECT_SAYS(refusal<InvalidInput>([&] { levelset::requireLengths(field); }),
                "x and y are degrees");
    const HeightField metres = levelset::metricHeights(field);
    EXPECT_NEAR(metres.spacing.x * 4, fact.east, support::measured(4.2e-4));
    EXPECT_NEAR(metres.spacing.y * 4, fact.north, support::measured(4.2e-4));
    EXPECT_NEAR(metres.position(1, 1).length(), 0, 1e-9);
    EXPECT_FALSE(metres.isGeographic);
    EXPECT_SAYS(metres.coordinateSystem, "WGS 84");
    EXPECT_NO_THROW(levelset::requireLengths(metres));
    EXPECT_SAYS(refusal<InvalidInput>([&] { static_cast<void>(levelset::metricHeights(metres)); }),
                "not degrees");
  }
  const HeightField pole{.columns = 1,
                         .rows = 2,
                         .origin = {0, 89},
                         .spacing = {1, 1},
                         .heights = {0, 0},
                         .isGeographic = true};
  EXPECT_SAYS(refusal<InvalidInput>([&] { static_cast<void>(levelset::metricHeights(pole)); }),
              "contains a pole");
}

TEST(HeightField, ComesFromAVolumeOfOneLayer) {
  levelset::VolumeGrid grid{.size = {3, 2, 1}};
  grid.indexToWorld[0][0] = 2;
  grid.indexToWorld[1][1] = 3;
  grid.indexToWorld[3][0] = 7;
  const levelset::Volume volume(grid, {1, 2, 3, 4, 5, -9});
  const HeightField field = levelset::heightsOf(volume, -9);
  EXPECT_EQ(field.origin, V2d(7, 0));
  EXPECT_EQ(field.spacing, V2d(2, 3));
  EXPECT_EQ(field.point(1, 1), V3d(9, 3, 5));
  EXPECT_TRUE(field.isMissing(2, 1));
  EXPECT_EQ(levelset::flippedHeights(field).at(0, 0), 4);
  EXPECT_EQ(levelset::scaledHeights(field, 2).at(1, 1), 10);
  EXPECT_SAYS(
      refusal<levelset::UsageError>([&] { static_cast<void>(levelset::scaledHeights(field, 0)); }),
      "other than 0");
  EXPECT_SAYS(
      refusal<InvalidInput>([&] { static_cast<void>(levelset::scaledHeights(field, 1e38)); }),
      "is infinite");
  EXPECT_SAYS(refusal<levelset::ResourceLimit>(
                  [&] { static_cast<void>(levelset::heightsOf(volume, {}, 20)); }),
              "");
  grid.size = {3, 1, 2};
  EXPECT_SAYS(refusal<InvalidInput>([&] {
                static_cast<void>(levelset::heightsOf(levelset::Volume(grid, {1, 2, 3, 4, 5, 6})));
              }),
              "has 2 layers");
}

}  // namespace height_field_test
