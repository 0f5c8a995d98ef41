// Index sets of terrain patches beside coarser ones, and the error of leaving vertices out.

#include "render/terrain/patch_borders.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <utility>

#include "tests/support/terrain_stores.h"

namespace patch_borders_test {

using namespace render;

using Place = std::pair<int, int>;

Place placeOf(int number, int cells) {
  return {number % (cells + 1), number / (cells + 1)};
}

/// Twice the area of a triangle of three samples, positive if it runs counter-clockwise.
int areaOf(Place a, Place b, Place c) {
  return (b.first - a.first) * (c.second - a.second) - (b.second - a.second) * (c.first - a.first);
}

/// Each set covers the square once. Its border has all samples of a side, or every second one.
TEST(PatchBorders, CoverThePatchOnce) {
  for (const int cells : {2, 4, 8, 16}) {
    const PatchBorderSets sets(cells);
    std::size_t total = 0;
    for (unsigned coarser = 0; coarser < 16; ++coarser) {
      const auto numbers = sets.triangles(coarser);
      int sides = 0, area = 0;
      for (const PatchSide side : kPatchSides) sides += (coarser & side) != 0;
      EXPECT_EQ(static_cast<int>(numbers.size() / 3), 2 * cells * cells - sides * cells / 2);
      std::map<std::pair<Place, Place>, int> edges;
      for (std::size_t n = 0; n < numbers.size(); n += 3) {
        const Place p[] = {placeOf(numbers[n], cells), placeOf(numbers[n + 1], cells),
                           placeOf(numbers[n + 2], cells)};
        EXPECT_GT(areaOf(p[0], p[1], p[2]), 0);
        area += areaOf(p[0], p[1], p[2]);
        for (int k = 0; k < 3; ++k) ++edges[{p[k], p[(k + 1) % 3]}];
      }
      EXPECT_EQ(area, 2 * cells * cells);
      for (const auto& [edge, count] : edges) {
        EXPECT_EQ(count, 1);
        if (edges.count({edge.second, edge.first})) continue;
        const auto [a, b] = edge;
        const unsigned side = a.second == 0 && b.second == 0           ? SouthSide
                              : a.first == cells && b.first == cells   ? EastSide
                              : a.second == cells && b.second == cells ? NorthSide
                                                                       : WestSide;
        const int length = std::abs(b.first - a.first) + std::abs(b.second - a.second);
        EXPECT_EQ(length, coarser & side ? 2 : 1);
      }
      total += numbers.size();
    }
    EXPECT_EQ(total, sets.indices().size());
  }
}

/// Height of a triangulated patch at a point that counts samples of the field.
double heightIn(const PatchGrid& grid, const TerrainPatch& patch,
                std::span<const std::uint16_t> numbers, std::span<const float> heights, double x,
                double y) {
  const int cells = grid.layout().pyramid.cells;
  for (std::size_t n = 0; n < numbers.size(); n += 3) {
    double px[3], py[3], pz[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [i, j] = placeOf(numbers[n + k], cells);
      px[k] = grid.sampleColumn(patch, i);
      py[k] = grid.sampleRow(patch, j);
      pz[k] = static_cast<double>(heights[numbers[n + k]]);
    }
    const auto area = [&](std::size_t a, std::size_t b) {
      return (px[b] - px[a]) * (y - py[a]) - (py[b] - py[a]) * (x - px[a]);
    };
    const double a = area(1, 2), b = area(2, 0), c = area(0, 1), whole = a + b + c;
    if (whole > 0 && a >= 0 && b >= 0 && c >= 0) return (a * pz[0] + b * pz[1] + c * pz[2]) / whole;
  }
  ADD_FAILURE() << "no triangle at " << x << ", " << y;
  return 0;
}

/// The errors are the largest distances of the two triangulations, on complete patches and on
/// those that the border of the field cuts. The distances are taken at quarters of the cells,
/// which include the centres.
TEST(PatchBorders, HaveExactErrors) {
  for (const auto& [columns, rows] : {std::pair{33, 33}, {30, 23}, {27, 29}}) {
    const auto store =
        support::storeOf(support::cutTerrain(support::fractalTerrain(5, 1, 3), columns, rows), 4);
    const PatchGrid grid(store->layout());
    const PatchBorderSets sets(4);
    for (int level = 0; level < grid.topLevel(); ++level) {
      const auto& patches = store->layout().pyramid.levels[static_cast<std::size_t>(level)];
      for (int row = 0; row < patches.rows; ++row)
        for (int column = 0; column < patches.columns; ++column) {
          const TerrainPatch patch{level, column, row};
          std::vector<float> heights(25);
          store->readPatch(level, column, row, heights);
          const std::array<float, 4> errors = patchBorderErrors(grid, patch, heights);
          for (unsigned coarser = 1; coarser < 16; ++coarser) {
            float bound = 0;
            bool isPossible = true;
            for (std::size_t n = 0; n < 4; ++n) {
              if ((coarser & kPatchSides[n]) == 0) continue;
              bound = std::max(bound, errors[n]);
              isPossible = isPossible && grid.neighbour(patch, kPatchSides[n]);
            }
            if (!isPossible) continue;
            double largest = 0;
            const double quarter = 0.25 * (1 << level);
            for (double y = grid.sampleRow(patch, 0); y <= grid.sampleRow(patch, 4); y += quarter)
              for (double x = grid.sampleColumn(patch, 0); x <= grid.sampleColumn(patch, 4);
                   x += quarter)
                largest = std::max(
                    largest,
                    std::abs(heightIn(grid, patch, sets.triangles(coarser), heights, x, y) -
                             heightIn(grid, patch, sets.triangles(0), heights, x, y)));
            EXPECT_LE(largest, static_cast<double>(bound) * (1 + 1e-12));
            // Centres of cells that the border cuts are not at quarters.
            if (columns == 33) {
              EXPECT_GE(largest * (1 + 1e-6), static_cast<double>(bound));
            }
          }
        }
    }
  }
}

TEST(PatchBorders, AreInfiniteBesideMissingSamples) {
  auto field = support::fractalTerrain(4, 1, 3);
  field.heights[field.index(6, 1)] = levelset::kMissingHeight;
  const auto store = support::storeOf(field, 4);
  const PatchGrid grid(store->layout());
  std::vector<float> heights(25);
  store->readPatch(0, 1, 0, heights);
  const auto errors = patchBorderErrors(grid, {0, 1, 0}, heights);
  EXPECT_TRUE(std::isinf(errors[0]));
  EXPECT_TRUE(std::isfinite(errors[1]) && std::isfinite(errors[2]) && std::isfinite(errors[3]));
}

}  // namespace patch_borders_test
