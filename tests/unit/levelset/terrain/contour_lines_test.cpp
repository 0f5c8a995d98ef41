#include "levelset/terrain/contour_lines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "levelset/error.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/terrains.h"
#include "tests/support/threads.h"

namespace contour_lines_test {

using Imath::V2d;
using levelset::ContourLine;
using levelset::contourLines;
using levelset::HeightField;
using support::refusal;
using support::terrainOf;

/// Area inside a closed line, positive if it runs counter-clockwise.
double areaOf(const ContourLine& line) {
  double sum = 0;
  for (std::size_t n = 0; n < line.points.size(); ++n) {
    const V2d a = line.points[n], b = line.points[(n + 1) % line.points.size()];
    sum += a.x * b.y - a.y * b.x;
  }
  return sum / 2;
}

TEST(ContourLines, ConvergeToCirclesInSecondOrder) {
  double radii[3], areas[3];
  for (int n = 0; n < 3; ++n) {
    const int cells = 21 << n;
    const HeightField hill = terrainOf(cells + 1, cells + 1, {3.0 / cells, 3.0 / cells},
                                       [](double x, double y) { return 2 - x * x - y * y; });
    const std::vector<ContourLine> lines = contourLines(hill, {1});
    ASSERT_EQ(lines.size(), 1u);
    ASSERT_TRUE(lines[0].isClosed);
    EXPECT_EQ(lines[0].height, 1);
    radii[n] = 0;
    for (const V2d& p : lines[0].points) radii[n] = std::max(radii[n], std::abs(p.length() - 1));
    // The hill is on the left, so the line runs counter-clockwise.
    areas[n] = std::abs(areaOf(lines[0]) - std::numbers::pi);
    EXPECT_LT(areaOf(contourLines(levelset::scaledHeights(hill, -1), {-1})[0]), 0);
  }
  EXPECT_LT(radii[2], support::measured(1.6e-4));
  EXPECT_LT(areas[2], support::measured(1.3e-3));
  for (int n = 0; n < 2; ++n) {
    EXPECT_GT(std::log2(radii[n] / radii[n + 1]), support::measuredOrder(2));
    EXPECT_GT(std::log2(areas[n] / areas[n + 1]), support::measuredOrder(2));
  }
}

TEST(ContourLines, EndAtTheBorderOnAPlane) {
  const HeightField field = terrainOf(9, 7, {1, 2}, [](double x, double) { return 2 * x; });
  const std::vector<ContourLine> lines = contourLines(field, {-8, -1, 0, 3, 8, 9});
  ASSERT_EQ(lines.size(), 4u);  // nothing is below −8 or reaches 9
  const double at[] = {-0.5, 0, 1.5, 4};
  for (std::size_t n = 0; n < 4; ++n) {
    EXPECT_FALSE(lines[n].isClosed);
    ASSERT_EQ(lines[n].points.size(), 7u);
    // Higher ground, to the east, is on the left of a line to the south.
    for (std::size_t k = 0; k < 7; ++k)
      EXPECT_EQ(lines[n].points[k], V2d(at[n], 6 - 2 * static_cast<double>(k)));
  }
}

TEST(ContourLines, DecideSaddlesByTheBilinearSurface) {
  // Corners 1 and 1 on a diagonal, 0 and 0 on the other: the saddle is at 1/2.
  const HeightField field{.columns = 2, .rows = 2, .heights = {1, 0, 0, 1}};
  const auto joinsHigh = [&](double height) {
    const std::vector<ContourLine> lines = contourLines(field, {height});
    EXPECT_EQ(lines.size(), 2u);
    // A piece around the high corner (0, 0) joins the edges that meet there.
    for (const ContourLine& line : lines)
      for (const V2d& p : line.points)
        if (p.y == 0) return (line.points[0] + line.points[1]).x > 1;
    return false;
  };
  EXPECT_TRUE(joinsHigh(0.25));
  EXPECT_TRUE(joinsHigh(0.5));
  EXPECT_FALSE(joinsHigh(0.75));
}

TEST(ContourLines, RunThroughSamplesAtTheirHeight) {
  // A peak, a pit and a level row at the height of the line.
  HeightField peak = terrainOf(5, 5, {1, 1}, [](double x, double y) { return x == 0 && y == 0; });
  EXPECT_TRUE(contourLines(peak, {1}).empty());  // a single point
  ASSERT_EQ(contourLines(peak, {0.5}).size(), 1u);
  EXPECT_EQ(areaOf(contourLines(peak, {0.5})[0]), 0.5);
  EXPECT_TRUE(contourLines(peak, {0}).empty());  // nothing is below
  const HeightField step = terrainOf(5, 3, {1, 1}, [](double, double y) { return y; });
  const std::vector<ContourLine> lines = contourLines(step, {0});
  ASSERT_EQ(lines.size(), 1u);
  ASSERT_EQ(lines[0].points.size(), 5u);
  EXPECT_EQ(lines[0].points[0], V2d(-2, 0));  // to the east: higher ground is on the left
  EXPECT_EQ(lines[0].points[4], V2d(2, 0));
}

/// On random heights, each crossed edge of complete cells belongs to one line, lines end only where
/// one cell has the edge, and each point has the height of its line.
TEST(ContourLines, CoverEachCrossedEdgeOnce) {
  for (const double missing : {0.0, 0.15}) {
    const HeightField field = support::randomTerrain(40, 30, missing, 11);
    const auto isCell = [&](int column, int row) {
      return column >= 0 && row >= 0 && column < 39 && row < 29 && !field.isMissing(column, row) &&
             !field.isMissing(column + 1, row) && !field.isMissing(column, row + 1) &&
             !field.isMissing(column + 1, row + 1);
    };
    std::map<std::pair<double, double>, int> cells;  // number of cells at each crossing
    const double height = 0.5;
    for (int row = 0; row < 30; ++row)
      for (int column = 0; column < 40; ++column)
        for (const bool isAlongY : {false, true}) {
          if (isAlongY ? row + 1 >= 30 : column + 1 >= 40) continue;
          const int around = isAlongY ? isCell(column, row) + isCell(column - 1, row)
                                      : isCell(column, row) + isCell(column, row - 1);
          const double a = field.at(column, row),
                       b = isAlongY ? field.at(column, row + 1) : field.at(column + 1, row);
          if (around == 0 || (a >= height) == (b >= height)) continue;
          const double share = (height - a) / (b - a);
          V2d p = field.position(column, row);
          (isAlongY ? p.y : p.x) += share;
          cells[{p.x, p.y}] = around;
        }
    std::size_t points = 0;
    for (const ContourLine& line : contourLines(field, {height})) {
      for (std::size_t n = 0; n < line.points.size(); ++n) {
        const auto found = cells.find({line.points[n].x, line.points[n].y});
        ASSERT_NE(found, cells.end());
        const bool isEnd = !line.isClosed && (n == 0 || n + 1 == line.points.size());
        EXPECT_EQ(found->second, isEnd ? 1 : 2);
        ++points;
      }
    }
    EXPECT_EQ(points, cells.size());
    EXPECT_GT(points, 500u);
  }
}

TEST(ContourLines, GiveTheSameBitsForAnyNumberOfThreads) {
  const HeightField field = support::randomTerrain(80, 70, 0.05, 13);
  const std::vector<double> heights = levelset::contourHeights(field, 0.1);
  EXPECT_EQ(heights.size(), 9u);
  const auto run = [&] { return contourLines(field, heights); };
  const std::vector<ContourLine> one = support::onThreads(1, run),
                                 four = support::onThreads(4, run);
  ASSERT_EQ(one.size(), four.size());
  for (std::size_t n = 0; n < one.size(); ++n) {
    EXPECT_EQ(one[n].height, four[n].height);
    EXPECT_EQ(one[n].points, four[n].points);
  }
}

TEST(ContourLines, ChooseHeights) {
  const HeightField field = terrainOf(5, 2, {1, 1}, [](double x, double) { return 10 * x; });
  EXPECT_EQ(levelset::contourHeights(field, 10), (std::vector<double>{-20, -10, 0, 10, 20}));
  EXPECT_EQ(levelset::contourHeights(field, 15, 5), (std::vector<double>{-10, 5, 20}));
  EXPECT_TRUE(levelset::contourHeights(support::randomTerrain(2, 2, 1.1, 1), 1).empty());
  const auto refused = [&](double interval, double base) {
    return refusal<levelset::UsageError>(
        [&] { static_cast<void>(levelset::contourHeights(field, interval, base)); });
  };
  EXPECT_SAYS(refused(0, 0), "positive interval");
  EXPECT_SAYS(refused(1, NAN), "finite base");
  EXPECT_SAYS(refused(1e-5, 0), "give a larger interval");
  // Whole numbers beyond 2^53 cannot be counted by one.
  EXPECT_SAYS(refused(1, 1e17), "is too small for heights");
}

TEST(ContourLines, RefuseHeightsAndTooLittleMemory) {
  const HeightField field = support::randomTerrain(50, 50, 0, 1);
  EXPECT_SAYS(refusal<levelset::UsageError>([&] {
                static_cast<void>(contourLines(field, {1, 0.5}));
              }),
              "number 2");
  EXPECT_SAYS(refusal<levelset::UsageError>([&] { static_cast<void>(contourLines(field, {NAN})); }),
              "number 1");
  EXPECT_SAYS(refusal<levelset::ResourceLimit>(
                  [&] { static_cast<void>(contourLines(field, {0.5}, {.maxMemory = 10'000})); }),
              "");
  // Lines through samples have equal points, which are left out and take no memory.
  const HeightField steps = terrainOf(
      300, 300, {1, 1}, [](double x, double y) { return std::floor(x / 3) + std::floor(y / 5); });
  std::size_t lines = 0;
  levelset::forEachContourLine(steps, {-20, -10, 0, 10, 20}, [&](const ContourLine&) { ++lines; },
                               {.maxMemory = 400'000});
  EXPECT_EQ(lines, 5u);
  const HeightField row = support::randomTerrain(50, 1, 0, 1);
  EXPECT_TRUE(contourLines(row, {0.5}).empty());
}

}  // namespace contour_lines_test
