#include "levelset/terrain/ground_slope.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "levelset/error.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/terrains.h"
#include "tests/support/threads.h"

namespace ground_slope_test {

using levelset::aspectDegrees;
using levelset::HeightField;
using levelset::hillshade;
using levelset::slopeDegrees;
using support::refusal;
using support::rounding;
using support::terrainOf;

constexpr double kDegrees = 180 / std::numbers::pi;

TEST(GroundSlope, IsExactOnAPlane) {
  const HeightField field =
      terrainOf(9, 7, {0.5, 2}, [](double x, double y) { return 0.75 * x - 0.25 * y + 3; });
  const double slope = std::atan(std::hypot(0.75, 0.25)) * kDegrees;
  // It falls towards −x and +y, which is north-west.
  const double aspect = 360 - std::atan2(0.75, 0.25) * kDegrees;
  for (const bool edges : {false, true}) {
    const HeightField slopes = slopeDegrees(field, {.edges = edges}),
                      aspects = aspectDegrees(field, {.edges = edges});
    EXPECT_EQ(slopes.missingCount(), edges ? 0u : 63u - 35u);
    EXPECT_EQ(slopes.origin, field.origin);
    for (std::size_t n = 0; n < slopes.heights.size(); ++n) {
      EXPECT_EQ(std::isnan(slopes.heights[n]), std::isnan(aspects.heights[n]));
      if (std::isnan(slopes.heights[n])) continue;
      EXPECT_NEAR(slopes.heights[n], slope, slope * rounding(1));
      EXPECT_NEAR(aspects.heights[n], aspect, aspect * rounding(1));
    }
  }
}

TEST(GroundSlope, KnowsTheDirections) {
  const struct {
    double x, y, aspect;
  } facts[] = {{0, -1, 0},  {-1, -1, 45}, {-1, 0, 90}, {-1, 1, 135},
               {0, 1, 180}, {1, 1, 225},  {1, 0, 270}, {1, -1, 315}};
  for (const auto& fact : facts) {
    const HeightField field =
        terrainOf(3, 3, {1, 1}, [&](double x, double y) { return fact.x * x + fact.y * y; });
    EXPECT_NEAR(aspectDegrees(field).at(1, 1), fact.aspect, 1e-4);
  }
  const HeightField level = terrainOf(3, 3, {1, 1}, [](double, double) { return 5; });
  EXPECT_EQ(slopeDegrees(level).at(1, 1), 0);
  EXPECT_TRUE(aspectDegrees(level).isMissing(1, 1));
}

/// Central differences are exact on quadratic grounds, and converge in second order on others.
TEST(GroundSlope, ConvergesInSecondOrder) {
  const HeightField bowl =
      terrainOf(9, 9, {0.5, 0.25}, [](double x, double y) { return x * x - 0.5 * y * y + x * y; });
  const HeightField slopes = slopeDegrees(bowl);
  for (int row = 1; row < 8; ++row)
    for (int column = 1; column < 8; ++column) {
      const Imath::V2d p = bowl.position(column, row);
      const double slope = std::atan(std::hypot(2 * p.x + p.y, p.x - p.y)) * kDegrees;
      EXPECT_NEAR(slopes.at(column, row), slope, slope * rounding(1));
    }
  double errors[3];
  for (int n = 0; n < 3; ++n) {
    const int cells = 16 << n;
    const HeightField waves =
        terrainOf(cells + 1, cells + 1, {4.0 / cells, 4.0 / cells},
                  [](double x, double y) { return std::sin(x) * std::cos(2 * y); });
    const HeightField of = slopeDegrees(waves);
    errors[n] = 0;
    for (int row = 1; row < cells; ++row)
      for (int column = 1; column < cells; ++column) {
        const Imath::V2d p = waves.position(column, row);
        const double exact = std::atan(std::hypot(std::cos(p.x) * std::cos(2 * p.y),
                                                  2 * std::sin(p.x) * std::sin(2 * p.y))) *
                             kDegrees;
        errors[n] = std::max(errors[n], std::abs(of.at(column, row) - exact));
      }
  }
  EXPECT_LT(errors[2], support::measured(0.131));
  for (int n = 0; n < 2; ++n)
    EXPECT_GT(std::log2(errors[n] / errors[n + 1]), support::measuredOrder(2));
}

TEST(GroundSlope, TreatsMissingNeighbours) {
  HeightField field = terrainOf(5, 5, {1, 1}, [](double x, double y) { return x + 2 * y; });
  field.heights[field.index(2, 2)] = levelset::kMissingHeight;
  EXPECT_EQ(slopeDegrees(field).missingCount(), 25u);
  const HeightField slopes = slopeDegrees(field, {.edges = true});
  EXPECT_EQ(slopes.missingCount(), 1u);
  const double slope = std::atan(std::sqrt(5.0)) * kDegrees;
  EXPECT_NEAR(slopes.at(1, 2), slope, slope * rounding(1));
  EXPECT_NEAR(slopes.at(1, 1), slope, slope * rounding(1));
  EXPECT_NEAR(slopes.at(0, 4), slope, slope * rounding(1));
  // Both neighbours along x are missing.
  field.heights[field.index(0, 2)] = levelset::kMissingHeight;
  EXPECT_TRUE(slopeDegrees(field, {.edges = true}).isMissing(1, 2));
  const HeightField row = terrainOf(5, 1, {1, 1}, [](double x, double) { return x; });
  EXPECT_EQ(slopeDegrees(row, {.edges = true}).missingCount(), 5u);
}

TEST(Hillshade, IsTheCosineOfTheLight) {
  const auto shadeOf = [](double slopeX, double slopeY, double azimuth, double altitude) {
    const HeightField field =
        terrainOf(3, 3, {1, 1}, [&](double x, double y) { return slopeX * x + slopeY * y; });
    return static_cast<int>(
        hillshade(field, {.azimuthDegrees = azimuth, .altitudeDegrees = altitude})[4]);
  };
  EXPECT_EQ(shadeOf(0, 0, 315, 45), 181);  // 1 + 254 sin 45°
  EXPECT_EQ(shadeOf(0, 0, 0, 90), 255);
  EXPECT_EQ(shadeOf(0, -1, 0, 45), 255);  // faces the light
  EXPECT_EQ(shadeOf(0, 1, 0, 45), 1);     // faces away
  EXPECT_EQ(shadeOf(-1, 0, 90, 45), 255);
  EXPECT_EQ(shadeOf(1, 0, 270, 45), 255);
  EXPECT_EQ(shadeOf(0.75, 0, 270, 0), 153);  // 1 + 254 × 3/5
  const HeightField field = terrainOf(4, 3, {1, 1}, [](double x, double) { return x; });
  const std::vector<std::uint8_t> shades = hillshade(field);
  EXPECT_EQ(shades[0], 0);  // beyond the border nothing is known
  EXPECT_NE(shades[5], 0);
  EXPECT_NE(hillshade(field, {.edges = true})[0], 0);
  EXPECT_EQ(hillshade(field, {.exaggeration = 2}), hillshade(levelset::scaledHeights(field, 2)));
}

/// Results of gdaldem (GDAL 3.6.2) for the six samples inside, which it computes in float.
TEST(GroundSlope, AgreesWithGdal) {
  const HeightField field = levelset::flippedHeights(
      {.columns = 5, .rows = 4, .spacing = {10, 10}, .heights = {3, 7, 1, 9, 4, 6, 2, 8, 5, 7,
                                                                 1, 9, 4, 6, 2, 8, 3, 7, 1, 5}});
  const double slopes[] = {5.05115271, 5.05115271, 3.64697051, 5.43800783, 5.05115271, 9.2566824};
  const double aspects[] = {315, 315, 168.690063, 293.198608, 135, 147.528809};
  const int shades[] = {196, 196, 171, 196, 164, 150};
  const HeightField slope = slopeDegrees(field), aspect = aspectDegrees(field);
  const std::vector<std::uint8_t> shade = hillshade(field);
  for (int n = 0; n < 6; ++n) {
    const int column = 1 + n % 3, row = 2 - n / 3;  // GDAL begins in the north
    EXPECT_NEAR(slope.at(column, row), slopes[n], support::measured(4.1e-9));
    EXPECT_NEAR(aspect.at(column, row), aspects[n], 360 * rounding(1));
    EXPECT_EQ(shade[field.index(column, row)], shades[n]);
  }
}

TEST(Hillshade, RefusesAnglesAndDegrees) {
  HeightField field = terrainOf(3, 3, {1, 1}, [](double x, double) { return x; });
  const auto refused = [&](const levelset::HillshadeOptions& options) {
    return refusal<levelset::UsageError>([&] { static_cast<void>(hillshade(field, options)); });
  };
  EXPECT_SAYS(refused({.altitudeDegrees = 91}), "give 0 to 90");
  EXPECT_SAYS(refused({.azimuthDegrees = NAN}), "finite angle");
  EXPECT_SAYS(refused({.exaggeration = 0}), "positive number");
  field.isGeographic = true;
  EXPECT_SAYS(refusal<levelset::InvalidInput>([&] { static_cast<void>(hillshade(field)); }),
              "degrees");
  EXPECT_SAYS(refusal<levelset::InvalidInput>([&] { static_cast<void>(slopeDegrees(field)); }),
              "degrees");
  const HeightField large = support::randomTerrain(500, 500, 0, 1);
  EXPECT_THROW(static_cast<void>(slopeDegrees(large, {.maxMemory = 900'000})),
               levelset::ResourceLimit);
  EXPECT_THROW(static_cast<void>(aspectDegrees(large, {.maxMemory = 900'000})),
               levelset::ResourceLimit);
  EXPECT_THROW(static_cast<void>(hillshade(large, {.maxMemory = 200'000})),
               levelset::ResourceLimit);
}

TEST(GroundSlope, GivesTheSameBitsForAnyNumberOfThreads) {
  const HeightField field = support::randomTerrain(101, 67, 0.02, 5);
  EXPECT_EQ(support::onThreads(1, [&] { return slopeDegrees(field).contentHash(); }),
            support::onThreads(4, [&] { return slopeDegrees(field).contentHash(); }));
  EXPECT_EQ(support::onThreads(1, [&] { return hillshade(field); }),
            support::onThreads(4, [&] { return hillshade(field); }));
}

}  // namespace ground_slope_test
