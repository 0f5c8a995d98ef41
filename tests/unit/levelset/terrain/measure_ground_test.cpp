#include "levelset/terrain/measure_ground.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "levelset/error.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/terrains.h"
#include "tests/support/threads.h"

namespace measure_ground_test {

using Imath::V2d;
using levelset::GroundMeasures;
using levelset::HeightField;
using levelset::measureGround;
using support::doubleRounding;
using support::measured;
using support::measuredOrder;
using support::refusal;
using support::terrainOf;

constexpr double kPi = std::numbers::pi;

TEST(MeasureGround, IsExactOnAPlane) {
  // Heights that float holds exactly.
  const HeightField field =
      terrainOf(17, 9, {0.5, 2}, [](double x, double y) { return 0.75 * x - 0.25 * y + 3; });
  const GroundMeasures m = measureGround(field);
  EXPECT_EQ(m.projectedArea, 8 * 16);
  EXPECT_NEAR(m.area, 128 * std::sqrt(1 + 0.5625 + 0.0625), 128 * doubleRounding(4));
  EXPECT_EQ(m.meanHeight, 3);
  EXPECT_EQ(m.triangles, 2u * 16 * 8);
  EXPECT_EQ(m.missing, 0u);
  EXPECT_EQ(m.lowest, -2);
  EXPECT_EQ(m.highest, 8);
  EXPECT_NEAR(m.volumeAbove - m.volumeBelow, 3 * 128, 128 * doubleRounding(8));
  // The ground is its own plane.
  const GroundMeasures own = measureGround(field, {.height = 3, .slope = {0.75, -0.25}});
  EXPECT_EQ(own.volumeAbove, 0);
  EXPECT_EQ(own.volumeBelow, 0);
}

/// A pyramid over |x| + |y| ≤ r. Its edges lie along the grid, and its base crosses the cells.
TEST(MeasureGround, HasTheVolumeOfAPyramid) {
  const HeightField field = terrainOf(
      33, 33, {1, 1}, [](double x, double y) { return 10.25 - 1.5 * (std::abs(x) + std::abs(y)); });
  const double r = 10.25 / 1.5;
  const double volume = 2 * r * r * 10.25 / 3;
  EXPECT_NEAR(measureGround(field).volumeAbove, volume, volume * doubleRounding(8));
  // The same pyramid on the other side of the plane.
  const HeightField pit = levelset::scaledHeights(field, -1);
  EXPECT_NEAR(measureGround(pit).volumeBelow, volume, volume * doubleRounding(8));
  // A plane that is inclined along x cuts a pyramid with the apex at 10.25, too: along x, its base
  // reaches to 10.25 / 1.75 on one side and 10.25 / 1.25 on the other.
  const double inclined = (10.25 / 1.75 + 10.25 / 1.25) * r * 10.25 / 3;
  EXPECT_NEAR(measureGround(field, {.slope = {0.25, 0}}).volumeAbove, inclined,
              inclined * doubleRounding(2));
}

TEST(MeasureGround, ConvergesInSecondOrder) {
  double paraboloid[3], cone[3], cylinder[3];
  for (int n = 0; n < 3; ++n) {
    const int cells = 40 << n;
    const V2d spacing(2.5 / cells, 2.5 / cells);
    const auto volume = [&](const auto& f) {
      return measureGround(terrainOf(cells + 1, cells + 1, spacing, f)).volumeAbove;
    };
    paraboloid[n] =
        std::abs(volume([](double x, double y) { return 1 - x * x - y * y; }) - kPi / 2);
    cone[n] = std::abs(volume([](double x, double y) { return 1 - std::hypot(x, y); }) - kPi / 3);
    // A parabola of the length ∫ √(1 + 4x²) from −1.25 to 1.25, 2.5 wide.
    const double length = 1.25 * std::sqrt(7.25) + std::asinh(2.5) / 2;
    cylinder[n] = std::abs(measureGround(terrainOf(cells + 1, cells + 1, spacing,
                                                   [](double x, double) { return x * x; }))
                               .area -
                           2.5 * length);
  }
  EXPECT_LT(paraboloid[2], measured(2.6e-4));
  EXPECT_LT(cone[2], measured(1.3e-4));
  EXPECT_LT(cylinder[2], measured(9.5e-5));
  for (int n = 0; n < 2; ++n) {
    EXPECT_GT(std::log2(paraboloid[n] / paraboloid[n + 1]), measuredOrder(2));
    EXPECT_GT(std::log2(cone[n] / cone[n + 1]), measuredOrder(2));
    EXPECT_GT(std::log2(cylinder[n] / cylinder[n + 1]), measuredOrder(2));
  }
}

TEST(MeasureGround, LeavesOutTrianglesWithMissingCorners) {
  HeightField field = terrainOf(5, 5, {1, 1}, [](double, double) { return 2; });
  field.heights[field.index(2, 2)] = levelset::kMissingHeight;
  GroundMeasures m = measureGround(field);
  EXPECT_EQ(m.triangles, 32u - 6u);
  EXPECT_EQ(m.projectedArea, 13);
  EXPECT_EQ(m.volumeAbove, 26);
  EXPECT_EQ(m.meanHeight, 2);
  EXPECT_EQ(m.missing, 1u);
  field.heights.assign(25, levelset::kMissingHeight);
  m = measureGround(field);
  EXPECT_EQ(m.triangles, 0u);
  EXPECT_EQ(m.area, 0);
  EXPECT_EQ(m.meanHeight, 0);
  EXPECT_EQ(m.missing, 25u);
  // A single row has no area.
  EXPECT_EQ(measureGround(terrainOf(5, 1, {1, 1}, [](double, double) { return 2; })).area, 0);
}

TEST(MeasureGround, GivesTheSameBitsForAnyNumberOfThreads) {
  const HeightField field = support::randomTerrain(301, 203, 0.1, 5);
  const auto run = [&] { return measureGround(field, {.height = 0.4, .slope = {1e-3, 1e-4}}); };
  const GroundMeasures one = support::onThreads(1, run), four = support::onThreads(4, run);
  EXPECT_EQ(one.area, four.area);
  EXPECT_EQ(one.volumeAbove, four.volumeAbove);
  EXPECT_EQ(one.volumeBelow, four.volumeBelow);
  EXPECT_EQ(one.meanHeight, four.meanHeight);
}

TEST(MeasureGround, RefusesDegreesAndStops) {
  HeightField field = support::randomTerrain(5, 5, 0, 5);
  EXPECT_SAYS(refusal<levelset::Cancelled>([&] {
                static_cast<void>(measureGround(field, {}, [](double) { return false; }));
              }),
              "");
  field.isGeographic = true;
  EXPECT_SAYS(refusal<levelset::InvalidInput>([&] { static_cast<void>(measureGround(field)); }),
              "terrain --metric");
}

}  // namespace measure_ground_test
