#include "levelset/terrain/height_pyramid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "levelset/error.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/terrains.h"
#include "tests/support/threads.h"

namespace height_pyramid_test {

using levelset::HeightField;
using levelset::HeightPyramid;
using levelset::heightPyramid;
using levelset::PyramidPatch;
using support::refusal;
using support::terrainOf;

/// Height of the two triangles over a rectangle of samples, at a point that counts samples.
double heightAt(const HeightField& field, int c0, int r0, int c1, int r1, double x, double y) {
  const double u = (x - c0) / (c1 - c0), v = (y - r0) / (r1 - r0);
  const double low = field.at(c0, r0), high = field.at(c1, r1);
  if (u >= v) return low + (field.at(c1, r0) - low) * u + (high - field.at(c1, r0)) * v;
  return low + (field.at(c0, r1) - low) * v + (high - field.at(c0, r1)) * u;
}

TEST(HeightPyramid, HasOnePatchAtItsTop) {
  const HeightPyramid pyramid = heightPyramid(support::randomTerrain(65, 33, 0, 1), {.cells = 8});
  ASSERT_EQ(pyramid.levels.size(), 4u);
  const int columns[] = {8, 4, 2, 1}, rows[] = {4, 2, 1, 1};
  for (std::size_t n = 0; n < 4; ++n) {
    EXPECT_EQ(pyramid.levels[n].columns, columns[n]);
    EXPECT_EQ(pyramid.levels[n].rows, rows[n]);
  }
  // A sample beyond a power of two begins another patch.
  EXPECT_EQ(heightPyramid(support::randomTerrain(66, 33, 0, 1), {.cells = 8}).levels.size(), 5u);
  EXPECT_EQ(heightPyramid(support::randomTerrain(2, 2, 0, 1)).levels.size(), 1u);
}

/// A plane has no error at any level, also on patches that the border cuts.
TEST(HeightPyramid, IsExactOnAPlane) {
  const HeightField whole =
      terrainOf(65, 65, {1, 1}, [](double x, double y) { return 2 * x - 0.5 * y; });
  for (const auto& level : heightPyramid(whole, {.cells = 4}).levels)
    for (const PyramidPatch& patch : level.patches) EXPECT_EQ(patch.error, 0);
  const HeightField cut =
      terrainOf(60, 47, {1, 1}, [](double x, double y) { return 2 * x - 0.5 * y; });
  for (const auto& level : heightPyramid(cut, {.cells = 4}).levels)
    for (const PyramidPatch& patch : level.patches)
      EXPECT_LT(patch.error, support::doubleRounding(100 * 24));
}

/// A parabola: the chord over a stride of s has the error s² / 4.
TEST(HeightPyramid, HasTheErrorsOfAParabola) {
  const HeightField field = terrainOf(65, 65, {1, 1}, [](double x, double) { return x * x; });
  const HeightPyramid pyramid = heightPyramid(field);
  ASSERT_EQ(pyramid.levels.size(), 3u);
  for (const PyramidPatch& patch : pyramid.levels[1].patches) EXPECT_EQ(patch.error, 1);
  for (const PyramidPatch& patch : pyramid.levels[2].patches) EXPECT_EQ(patch.error, 4);
}

/// No point of the surfaces is farther apart than the error, and some point nearly as far.
TEST(HeightPyramid, BoundsTheDistanceAtAllPoints) {
  const HeightField field = support::randomTerrain(29, 22, 0, 5);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  const int rectangles[][4] = {{0, 0, 4, 4},   {3, 2, 8, 4}, {5, 5, 7, 12}, {1, 9, 12, 14},
                               {0, 0, 28, 21}, {4, 4, 5, 9}, {4, 4, 9, 5}};
  for (const auto& [c0, r0, c1, r1] : rectangles) {
    const double error = levelset::coarseCellError(field, c0, r0, c1, r1);
    double most = 0;
    const auto compareAt = [&](double x, double y) {
      const int c = std::min(static_cast<int>(x), c1 - 1),
                r = std::min(static_cast<int>(y), r1 - 1);
      most = std::max(most, std::abs(heightAt(field, c, r, c + 1, r + 1, x, y) -
                                     heightAt(field, c0, r0, c1, r1, x, y)));
    };
    for (int n = 0; n < 20'000; ++n) {
      compareAt(c0 + (c1 - c0) * unit(random), r0 + (r1 - r0) * unit(random));
      const double share = unit(random);  // the diagonal
      compareAt(c0 + (c1 - c0) * share, r0 + (r1 - r0) * share);
    }
    EXPECT_LE(most, error);
    for (int r = r0; r <= r1; ++r)
      for (int c = c0; c <= c1; ++c) compareAt(c, r);
    EXPECT_LE(most, error * (1 + support::doubleRounding(64)));
    EXPECT_GT(most, 0.98 * error);
  }
}

TEST(HeightPyramid, GrowsFromChildToParent) {
  const HeightField field = support::randomTerrain(100, 75, 0, 5);
  const HeightPyramid pyramid = heightPyramid(field, {.cells = 4});
  for (std::size_t n = 0; n < pyramid.levels.size(); ++n) {
    const levelset::PyramidLevel& level = pyramid.levels[n];
    for (int row = 0; row < level.rows; ++row)
      for (int column = 0; column < level.columns; ++column) {
        const PyramidPatch& patch = level.at(column, row);
        EXPECT_GE(patch.bound, patch.error);
        EXPECT_EQ(n == 0, patch.error == 0);
        if (n + 1 == pyramid.levels.size()) continue;
        const PyramidPatch& parent = pyramid.levels[n + 1].at(column / 2, row / 2);
        EXPECT_LE(patch.bound, parent.bound);
        EXPECT_LE(parent.lowest, patch.lowest);
        EXPECT_GE(parent.highest, patch.highest);
      }
  }
  EXPECT_EQ(pyramid.levels.back().patches[0].lowest, field.bounds().min.z);
  EXPECT_EQ(pyramid.levels.back().patches[0].highest, field.bounds().max.z);
}

TEST(HeightPyramid, KeepsMissingSamplesAtTheFinestLevel) {
  HeightField field = terrainOf(33, 33, {1, 1}, [](double, double) { return 1; });
  field.heights[field.index(3, 2)] = levelset::kMissingHeight;
  const HeightPyramid pyramid = heightPyramid(field, {.cells = 4});
  for (std::size_t n = 0; n < pyramid.levels.size(); ++n) {
    EXPECT_EQ(pyramid.levels[n].at(0, 0).error, n == 0 ? 0 : HUGE_VALF);
    if (n + 1 == pyramid.levels.size()) continue;
    EXPECT_EQ(pyramid.levels[n].patches.back().error, 0);
  }
  field.heights.assign(field.heights.size(), levelset::kMissingHeight);
  EXPECT_TRUE(std::isnan(heightPyramid(field).levels[0].at(0, 0).lowest));
}

TEST(HeightPyramid, HasTheSameBitsForAnyNumberOfThreads) {
  const HeightField field = support::randomTerrain(150, 131, 0.001, 5);
  const auto run = [&] { return heightPyramid(field); };
  const HeightPyramid one = support::onThreads(1, run), four = support::onThreads(4, run);
  for (std::size_t n = 0; n < one.levels.size(); ++n)
    for (std::size_t k = 0; k < one.levels[n].patches.size(); ++k) {
      EXPECT_EQ(one.levels[n].patches[k].error, four.levels[n].patches[k].error);
      EXPECT_EQ(one.levels[n].patches[k].bound, four.levels[n].patches[k].bound);
    }
}

TEST(HeightPyramid, RefusesOtherPatchesAndTooFewSamples) {
  const HeightField field = support::randomTerrain(9, 9, 0, 1);
  for (const int cells : {0, 1, 3, 256, -4})
    EXPECT_SAYS(refusal<levelset::UsageError>(
                    [&] { static_cast<void>(heightPyramid(field, {.cells = cells})); }),
                "power of two");
  EXPECT_SAYS(refusal<levelset::InvalidInput>(
                  [&] { static_cast<void>(heightPyramid(support::randomTerrain(9, 1, 0, 1))); }),
              "9x1");
  EXPECT_SAYS(refusal<levelset::ResourceLimit>([&] {
                static_cast<void>(heightPyramid(support::randomTerrain(513, 513, 0, 1),
                                                {.cells = 2, .maxMemory = 1'300'000}));
              }),
              "");
  EXPECT_SAYS(refusal<levelset::Cancelled>([&] {
                static_cast<void>(heightPyramid(field, {.progress = [](double) { return false; }}));
              }),
              "");
}

}  // namespace height_pyramid_test
