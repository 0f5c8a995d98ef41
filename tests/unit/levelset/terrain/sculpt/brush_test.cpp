#include "levelset/terrain/sculpt/brush.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "levelset/error.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/terrains.h"
#include "tests/support/threads.h"

namespace brush_test {

using Imath::V2d;
using levelset::applyDab;
using levelset::BrushDab;
using levelset::BrushEffect;
using levelset::HeightField;
using levelset::SampleRange;
using support::randomTerrain;
using support::terrainOf;

bool haveSameBits(const HeightField& a, const HeightField& b) {
  return a.heights.size() == b.heights.size() &&
         std::memcmp(a.heights.data(), b.heights.data(), a.memoryUse()) == 0;
}

double sumOf(const HeightField& field) {
  double sum = 0;
  for (const float height : field.heights)
    if (!std::isnan(height)) sum += static_cast<double>(height);
  return sum;
}

double weightAt(const HeightField& field, const BrushDab& dab, int column, int row) {
  const double share =
      1 - (field.position(column, row) - dab.center).length2() / (dab.radius * dab.radius);
  return share > 0 ? share * share : 0;
}

TEST(Brush, RaisesByItsProfile) {
  const HeightField flat = terrainOf(41, 31, {2, 3}, [](double, double) { return 0; });
  const BrushDab dab{.center = {4.5, -7}, .radius = 20, .strength = -3};
  HeightField field = flat;
  const SampleRange range = applyDab(field, dab);
  double worst = 0;
  for (int row = 0; row < field.rows; ++row)
    for (int column = 0; column < field.columns; ++column) {
      const double change = static_cast<double>(field.at(column, row));
      worst = std::max(worst, std::abs(change + 3 * weightAt(field, dab, column, row)));
      const bool isInRange = column >= range.firstColumn && column <= range.lastColumn &&
                             row >= range.firstRow && row <= range.lastRow;
      EXPECT_TRUE(isInRange || change == 0);
    }
  EXPECT_LT(worst, 3e-7);
  // The volume below (1 − r²/R²)² is a third of that of its cylinder.
  const HeightField fine = terrainOf(401, 401, {0.1, 0.1}, [](double, double) { return 0; });
  HeightField raised = fine;
  applyDab(raised, {.center = {0.03, 0.02}, .radius = 15, .strength = 2});
  const double pi = std::acos(-1.0);
  EXPECT_NEAR(sumOf(raised) * 0.01, 2 * pi * 15 * 15 / 3, support::measured(3.6e-7));
}

TEST(Brush, FlattensToALevel) {
  const HeightField wavy =
      terrainOf(33, 33, {1, 1}, [](double x, double y) { return std::sin(x) + std::cos(2 * y); });
  HeightField field = wavy;
  const BrushDab dab{.effect = BrushEffect::Flatten, .radius = 10, .strength = 0.5, .level = 7};
  applyDab(field, dab);
  for (int row = 0; row < 33; ++row)
    for (int column = 0; column < 33; ++column) {
      const double before = static_cast<double>(wavy.at(column, row));
      EXPECT_NEAR(static_cast<double>(field.at(column, row)),
                  before + 0.5 * weightAt(field, dab, column, row) * (7 - before), 5e-7);
    }
  // Without a level, the centre takes the weighted mean.
  HeightField mean = wavy;
  applyDab(mean, {.effect = BrushEffect::Flatten, .radius = 10, .strength = 1});
  double sum = 0, weights = 0;
  for (int row = 0; row < 33; ++row)
    for (int column = 0; column < 33; ++column) {
      const double weight = weightAt(field, dab, column, row);
      sum += weight * static_cast<double>(wavy.at(column, row));
      weights += weight;
    }
  EXPECT_NEAR(static_cast<double>(mean.at(16, 16)), sum / weights, 1e-7);
}

TEST(Brush, SmoothsWavesAndKeepsPlanes) {
  const HeightField plane =
      terrainOf(40, 40, {1, 2}, [](double x, double y) { return 100 + 0.5 * x - 0.25 * y; });
  HeightField field = plane;
  applyDab(field, {.effect = BrushEffect::Smooth, .radius = 30, .strength = 1, .passes = 20});
  EXPECT_TRUE(haveSameBits(field, plane));
  // The steepest wave vanishes at the centre in one pass.
  HeightField checker = terrainOf(41, 41, {1, 1}, [](double x, double y) {
    return std::fmod(std::abs(x + y), 2) < 0.5 ? 1 : -1;
  });
  applyDab(checker, {.effect = BrushEffect::Smooth, .radius = 15, .strength = 1, .passes = 1});
  EXPECT_EQ(checker.at(20, 20), 0);
  // A wave of length L along x loses s/4·(1 − cos 2π/L) of its height in a pass, where w is 1.
  HeightField wave = terrainOf(
      201, 201, {1, 1}, [](double x, double) { return std::cos(2 * std::acos(-1.0) * x / 10); });
  applyDab(wave, {.effect = BrushEffect::Smooth, .radius = 1e5, .strength = 0.8, .passes = 3});
  const double factor = 1 - 0.8 / 4 * (1 - std::cos(2 * std::acos(-1.0) / 10));
  EXPECT_NEAR(static_cast<double>(wave.at(100, 100)), std::pow(factor, 3),
              support::measured(2.4e-9));
}

TEST(Brush, SmoothsBothSidesAlike) {
  // A spike that the brush meets alone, and fields that are symmetric about the brush.
  HeightField spike =
      terrainOf(21, 21, {1, 1}, [](double x, double y) { return x == 0 && y == 0; });
  applyDab(spike, {.effect = BrushEffect::Smooth, .radius = 0.9, .strength = 1, .passes = 1});
  EXPECT_EQ(spike.at(10, 10), 0.5);
  for (const double radius : {1.5, 4.5}) {
    HeightField field =
        terrainOf(21, 21, {1, 1}, [](double x, double y) { return std::cos(x) * std::cos(2 * y); });
    applyDab(field, {.effect = BrushEffect::Smooth, .radius = radius, .strength = 1, .passes = 4});
    for (int row = 0; row < 21; ++row)
      for (int column = 0; column < 21; ++column) {
        EXPECT_EQ(field.at(column, row), field.at(20 - column, row));
        EXPECT_EQ(field.at(column, row), field.at(column, 20 - row));
      }
  }
}

TEST(Brush, AddsNoiseOfAWavelength) {
  HeightField a = terrainOf(201, 201, {1, 1}, [](double, double) { return 0; }), b = a, c = a;
  BrushDab dab{.effect = BrushEffect::Noise, .radius = 80, .strength = 10, .wavelength = 20};
  applyDab(a, dab);
  applyDab(b, dab);
  EXPECT_TRUE(haveSameBits(a, b));
  dab.seed = 1;
  applyDab(c, dab);
  EXPECT_FALSE(haveSameBits(a, c));
  float least = 0, most = 0, step = 0;
  for (int row = 0; row < 201; ++row)
    for (int column = 0; column < 200; ++column) {
      least = std::min(least, a.at(column, row));
      most = std::max(most, a.at(column, row));
      step = std::max(step, std::abs(a.at(column + 1, row) - a.at(column, row)));
    }
  EXPECT_GT(most, 3);    // 6.5 of the strength of 10
  EXPECT_LT(least, -2);  // -5.0
  EXPECT_LT(most - least, 20);
  EXPECT_LT(step, support::measured(0.96));  // a slope of 1.9 a wavelength
}

TEST(Brush, NoiseOfSuccessiveSeedsIsUnrelated) {
  const HeightField flat = terrainOf(201, 201, {1, 1}, [](double, double) { return 0; });
  const auto noiseOf = [&](std::uint32_t seed) {
    HeightField field = flat;
    applyDab(field, {.effect = BrushEffect::Noise,
                     .radius = 100,
                     .strength = 1,
                     .wavelength = 4,
                     .seed = seed});
    return field;
  };
  const auto product = [](const HeightField& a, const HeightField& b) {
    double sum = 0;
    for (std::size_t n = 0; n < a.heights.size(); ++n)
      sum += static_cast<double>(a.heights[n]) * static_cast<double>(b.heights[n]);
    return sum;
  };
  for (std::uint32_t seed = 0; seed < 8; ++seed) {
    const HeightField a = noiseOf(seed), b = noiseOf(seed + 1);
    const double correlation = product(a, b) / std::sqrt(product(a, a) * product(b, b));
    EXPECT_LT(std::abs(correlation), 0.07);  // at most 0.045
  }
}

TEST(Brush, ErosionMovesGroundAndKeepsItsVolume) {
  const HeightField cliff =
      terrainOf(41, 41, {2, 2}, [](double x, double) { return x > 0 ? 10 : 0; });
  HeightField field = cliff;
  BrushDab dab{
      .effect = BrushEffect::Erode, .radius = 38, .strength = 1, .talusDegrees = 30, .passes = 200};
  applyDab(field, dab);
  EXPECT_NEAR(sumOf(field) / sumOf(cliff), 1, support::measured(6e-9));
  for (const float height : field.heights) {
    EXPECT_GE(height, 0);
    EXPECT_LE(height, 10);
  }
  // At the middle, the cliff has become a slope near the talus.
  const auto steepest = [](const HeightField& f) {
    float slope = 0;
    for (int column = 0; column < 40; ++column)
      slope = std::max(slope, std::abs(f.at(column + 1, 20) - f.at(column, 20)) / 2);
    return static_cast<double>(slope);
  };
  EXPECT_EQ(steepest(cliff), 5);
  applyDab(field, dab);
  EXPECT_LT(steepest(field), 1.03 * std::tan(30 * std::acos(-1.0) / 180));
  // Slopes below the talus stay as they are.
  const HeightField gentle =
      terrainOf(50, 50, {1, 1}, [](double x, double y) { return 0.3 * x + 0.2 * y; });
  HeightField same = gentle;
  applyDab(same, dab);
  EXPECT_TRUE(haveSameBits(same, gentle));
}

TEST(Brush, KeepsMissingSamplesAndSamplesBesideIt) {
  const HeightField before = randomTerrain(50, 60, 0.2, 5);
  for (const BrushEffect effect : {BrushEffect::Raise, BrushEffect::Flatten, BrushEffect::Smooth,
                                   BrushEffect::Noise, BrushEffect::Erode}) {
    HeightField field = before;
    const BrushDab dab{
        .effect = effect, .center = {3, 4}, .radius = 12, .strength = 0.7, .talusDegrees = 10};
    const SampleRange range = applyDab(field, dab);
    EXPECT_FALSE(range.isEmpty());
    int changed = 0;
    for (int row = 0; row < field.rows; ++row)
      for (int column = 0; column < field.columns; ++column) {
        EXPECT_EQ(field.isMissing(column, row), before.isMissing(column, row));
        if (field.isMissing(column, row)) continue;
        const bool differs = field.at(column, row) != before.at(column, row);
        changed += differs;
        EXPECT_TRUE(!differs || weightAt(field, dab, column, row) > 0);
      }
    EXPECT_GT(changed, 200);
  }
}

TEST(Brush, HasTheSameBitsForAnyNumberOfThreads) {
  const HeightField before = randomTerrain(150, 150, 0.05, 9);
  for (const BrushEffect effect : {BrushEffect::Raise, BrushEffect::Flatten, BrushEffect::Smooth,
                                   BrushEffect::Noise, BrushEffect::Erode}) {
    HeightField a = before, b = before;
    const BrushDab dab{.effect = effect, .radius = 70, .strength = 1, .talusDegrees = 20};
    support::onThreads(1, [&] { applyDab(a, dab); });
    support::onThreads(4, [&] { applyDab(b, dab); });
    EXPECT_TRUE(haveSameBits(a, b));
  }
}

TEST(Brush, ReachesOverTheBorder) {
  HeightField field = terrainOf(20, 20, {1, 1}, [](double, double) { return 1; });
  const HeightField before = field;
  for (const V2d& center : {V2d(-30, 0), V2d(30, 0), V2d(0, -1e300), V2d(1e18, 1e18)})
    EXPECT_TRUE(applyDab(field, {.center = center, .radius = 10, .strength = 1}).isEmpty());
  EXPECT_TRUE(haveSameBits(field, before));
  const SampleRange corner = applyDab(field, {.center = {-12, -12}, .radius = 5, .strength = 1});
  EXPECT_EQ(corner.firstColumn, 0);
  EXPECT_EQ(corner.lastColumn, 3);  // the rim is at 2.5
  EXPECT_GT(field.at(0, 0), 1);
  EXPECT_EQ(applyDab(field, {.radius = 1e300, .strength = 1}).columns(), 20);
  // Between the samples, the brush changes none.
  EXPECT_TRUE(applyDab(field, {.center = {1, 1}, .radius = 0.3, .strength = 1}).isEmpty());
  // Far from the origin, positions still differ.
  HeightField far = before;
  far.origin = {1e6, -1e6};
  applyDab(far, {.center = {1e6 + 10, -1e6 + 10}, .radius = 4, .strength = 1});
  EXPECT_EQ(far.at(10, 10), 2);
}

TEST(Brush, RefusesNumbersOutOfRange) {
  HeightField field = terrainOf(9, 9, {1, 1}, [](double, double) { return 3e38; });
  const HeightField before = field;
  const auto refused = [&](BrushDab dab, const std::string& word) {
    const std::string text = support::refusal<levelset::UsageError>([&] { applyDab(field, dab); });
    EXPECT_NE(text.find(word), std::string::npos) << text;
  };
  refused({.radius = 0, .strength = 1}, "radius");
  refused({.radius = INFINITY, .strength = 1}, "radius");
  refused({.center = {NAN, 0}, .radius = 1, .strength = 1}, "centre");
  refused({.radius = 1, .strength = NAN}, "strength");
  refused({.effect = BrushEffect::Smooth, .radius = 1, .strength = 1.5}, "0 to 1");
  refused({.effect = BrushEffect::Flatten, .radius = 1, .strength = 1, .level = NAN}, "level");
  refused({.effect = BrushEffect::Noise, .radius = 1, .strength = 1, .wavelength = -1},
          "wavelength");
  refused({.effect = BrushEffect::Erode, .radius = 1, .strength = 1, .talusDegrees = 90}, "talus");
  refused({.effect = BrushEffect::Smooth, .radius = 1, .strength = 1, .passes = 0}, "passes");
  EXPECT_THROW(applyDab(field, {.radius = 4, .strength = 1e38}), levelset::InvalidInput);
  HeightField degrees = terrainOf(9, 9, {1, 1}, [](double x, double) { return x; });
  degrees.isGeographic = true;
  EXPECT_THROW(applyDab(degrees, {.effect = BrushEffect::Erode, .radius = 4, .strength = 1}),
               levelset::InvalidInput);
  EXPECT_TRUE(haveSameBits(field, before));
}

}  // namespace brush_test
