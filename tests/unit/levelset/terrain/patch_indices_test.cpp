#include "levelset/terrain/patch_indices.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <utility>

#include "levelset/error.h"
#include "tests/support/files.h"

namespace patch_indices_test {

using levelset::FinerNeighbours;
using levelset::PatchTriangle;
using levelset::patchTriangles;
using support::refusal;

/// Numbers of the index sets for all levels and neighbours.
struct IndexCount {
  std::size_t sets = 0, triangles = 0;
};
/// Each side may have a neighbour of the level or of any finer one.
IndexCount countIndices(int cells) {
  IndexCount count;
  for (int level = 0; level < levelset::patchLevelCount(cells); ++level)
    for (int south = 0; south <= level; ++south)
      for (int east = 0; east <= level; ++east)
        for (int north = 0; north <= level; ++north)
          for (int west = 0; west <= level; ++west) {
            ++count.sets;
            count.triangles += patchTriangles(cells, level, {south, east, north, west}).size();
          }
  return count;
}

/// Tables B6 and B7 of the thesis: 17x17 samples. The other sizes follow from the same formulas.
TEST(PatchIndices, HaveThePublishedNumbers) {
  const struct {
    int cells, levels;
    std::size_t sets, triangles, bytes;
  } facts[] = {{16, 4, 354, 14'816, 88'896},
               {32, 5, 979, 75'032, 450'192},
               {64, 6, 2275, 326'528, 1'959'168}};
  for (const auto& fact : facts) {
    EXPECT_EQ(levelset::patchLevelCount(fact.cells), fact.levels);
    const IndexCount count = countIndices(fact.cells);
    EXPECT_EQ(count.sets, fact.sets);
    EXPECT_EQ(count.triangles, fact.triangles);
    EXPECT_EQ(count.triangles * sizeof(PatchTriangle), fact.bytes);
  }
  EXPECT_EQ(levelset::publishedPatchBytes(16), 604u);
  // 16x16 new samples in each patch.
  EXPECT_LT(static_cast<double>(levelset::publishedPatchBytes(16)) / 256, 2.5);
}

/// Samples of a triangle as columns and rows.
std::array<std::pair<int, int>, 3> cornersOf(const PatchTriangle& triangle, int cells) {
  std::array<std::pair<int, int>, 3> corners;
  for (std::size_t n = 0; n < 3; ++n)
    corners[n] = {triangle[n] % (cells + 1), triangle[n] / (cells + 1)};
  return corners;
}

int twiceArea(const std::array<std::pair<int, int>, 3>& c) {
  return (c[1].first - c[0].first) * (c[2].second - c[0].second) -
         (c[1].second - c[0].second) * (c[2].first - c[0].first);
}

using Edge = std::pair<int, int>;

/// Edges with one triangle.
std::set<Edge> borderOf(const std::vector<PatchTriangle>& triangles) {
  std::set<Edge> border;
  for (const PatchTriangle& t : triangles)
    for (std::size_t n = 0; n < 3; ++n) {
      const Edge edge(t[n], t[(n + 1) % 3]);
      if (border.erase({edge.second, edge.first}) == 0) {
        EXPECT_TRUE(border.insert(edge).second) << "two triangles on one side of an edge";
      }
    }
  return border;
}

/// For all 354 sets: the triangles cover the patch once, all face upwards, and each border has the
/// edges of the finer of the two patches.
TEST(PatchIndices, CoverThePatchWithoutCracks) {
  constexpr int kCells = 16;
  std::size_t sets = 0;
  for (int level = 0; level < 4; ++level)
    for (int code = 0; code < (level + 1) * (level + 1) * (level + 1) * (level + 1); ++code) {
      const int base = level + 1;
      const int finer[4] = {code % base, code / base % base, code / base / base % base,
                            code / base / base / base};
      const std::vector<PatchTriangle> triangles =
          patchTriangles(kCells, level, {finer[0], finer[1], finer[2], finer[3]});
      int area = 0;
      for (const PatchTriangle& triangle : triangles) {
        const int twice = twiceArea(cornersOf(triangle, kCells));
        ASSERT_GT(twice, 0);
        area += twice;
      }
      EXPECT_EQ(area, 2 * kCells * kCells);
      std::set<Edge> expected;
      for (int side = 0; side < 4; ++side) {
        const int step = 1 << (level - finer[side]);
        const auto sample = [&](int at) {  // counter-clockwise along the side
          const int column = side == 0 ? at : side == 1 ? kCells : side == 2 ? kCells - at : 0;
          const int row = side == 0 ? 0 : side == 1 ? at : side == 2 ? kCells : kCells - at;
          return row * (kCells + 1) + column;
        };
        for (int at = 0; at < kCells; at += step) expected.insert({sample(at), sample(at + step)});
      }
      EXPECT_EQ(borderOf(triangles), expected);
      ++sets;
    }
  EXPECT_EQ(sets, 354u);
}

TEST(PatchIndices, RefuseWhatIsOutOfRange) {
  const auto refused = [](int cells, int level, const FinerNeighbours& finer) {
    return refusal<levelset::UsageError>(
        [&] { static_cast<void>(patchTriangles(cells, level, finer)); });
  };
  EXPECT_SAYS(refused(17, 0, {}), "power of two");
  EXPECT_SAYS(refused(1, 0, {}), "power of two");
  EXPECT_SAYS(refused(256, 0, {}), "power of two");
  EXPECT_SAYS(refused(16, 4, {}), "give 0 to 3");
  EXPECT_SAYS(refused(16, -1, {}), "give 0 to 3");
  EXPECT_SAYS(refused(16, 2, {.east = 3}), "finer by 3");
  EXPECT_SAYS(refused(16, 2, {.west = -1}), "finer by -1");
}

}  // namespace patch_indices_test
