#include "levelset/terrain/fill_heights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/terrains.h"

namespace fill_heights_test {

using levelset::filledHeights;
using levelset::HeightField;
using support::refusal;

/// Removes the samples in an ellipse about a sample.
HeightField pierced(HeightField field, int column, int row, double radius) {
  for (int j = 0; j < field.rows; ++j)
    for (int i = 0; i < field.columns; ++i)
      if (std::hypot(i - column, j - row) < radius)
        field.heights[field.index(i, j)] = levelset::kMissingHeight;
  return field;
}

double largestDifference(const HeightField& a, const HeightField& b) {
  double most = 0;
  for (std::size_t n = 0; n < a.heights.size(); ++n)
    most = std::max(most, static_cast<double>(std::abs(a.heights[n] - b.heights[n])));
  return most;
}

/// The differences of these polynomials satisfy the equations exactly, also on oblong cells.
TEST(FillHeights, ReproducesHarmonicPolynomials) {
  const auto check = [](const auto& f) {
    const HeightField whole = support::terrainOf(41, 31, {1, 0.5}, f);
    const HeightField filled = filledHeights(pierced(whole, 18, 15, 9.5));
    // Nearly all heights come back as the same floats.
    EXPECT_LT(largestDifference(filled, whole), support::measured(8e-9));
  };
  check([](double x, double y) { return 3 * x - 7 * y + 2; });
  check([](double x, double y) { return x * x - y * y; });
  check([](double x, double y) { return x * y; });
}

TEST(FillHeights, KeepsKnownSamplesAndTheirRange) {
  const HeightField field = support::randomTerrain(60, 50, 0.4, 3);
  const HeightField filled = filledHeights(field);
  EXPECT_EQ(filled.missingCount(), 0u);
  std::size_t same = 0;
  for (std::size_t n = 0; n < field.heights.size(); ++n)
    same += filled.heights[n] == field.heights[n];
  EXPECT_EQ(same, field.heights.size() - field.missingCount());
  EXPECT_EQ(filled.bounds().min.z, field.bounds().min.z);
  EXPECT_EQ(filled.bounds().max.z, field.bounds().max.z);
  EXPECT_EQ(filledHeights(filled).contentHash(), filled.contentHash());
}

TEST(FillHeights, RunsOutLevelAtTheBorder) {
  HeightField field = support::terrainOf(9, 1, {1, 1}, [](double x, double) { return x; });
  field.heights[7] = field.heights[8] = levelset::kMissingHeight;
  field.heights[3] = levelset::kMissingHeight;
  const HeightField filled = filledHeights(field);
  EXPECT_EQ(filled.heights[7], 2);
  EXPECT_EQ(filled.heights[8], 2);
  EXPECT_EQ(filled.heights[3], -1);
}

TEST(FillHeights, RefusesAFieldWithoutData) {
  const HeightField none = support::randomTerrain(4, 4, 1.1, 3);
  EXPECT_SAYS(refusal<levelset::InvalidInput>([&] { static_cast<void>(filledHeights(none)); }),
              "no sample has data");
  const HeightField some = support::randomTerrain(100, 100, 0.5, 3);
  EXPECT_SAYS(refusal<levelset::ResourceLimit>(
                  [&] { static_cast<void>(filledHeights(some, {.maxMemory = 100'000})); }),
              "");
  EXPECT_SAYS(refusal<levelset::Cancelled>([&] {
                static_cast<void>(filledHeights(some, {.progress = [](double) { return false; }}));
              }),
              "");
}

}  // namespace fill_heights_test
