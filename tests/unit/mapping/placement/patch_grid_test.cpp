#include "mapping/placement/patch_grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "mapping/patches/patch_mesh.h"
#include "mapping/placement/make_patch.h"
#include "tests/support/measured.h"
#include "tests/support/patches.h"

namespace patch_grid_test {

using Imath::V3d;
using levelset::NarrowBand;
using mapping::LayerScheme;
using mapping::makePatchGrid;
using mapping::makePatchGridAround;
using mapping::ParticleLayer;
using mapping::Patch;
using mapping::PatchGridResult;

constexpr double kPi = std::numbers::pi;

NarrowBand slab() {
  return support::sampleBand([](const V3d& p) { return p.z; }, {V3d(-2, -2, -0.4), V3d(2, 2, 0.4)},
                             0.1, 6);
}

NarrowBand pipe() {
  return levelset::makeCylinder(1, 4, V3d(0), V3d(0, 0, 1), 0.1, {.halfWidth = 8});
}

/// Expects equal borders on all layers. The right border of `a` equals the left border of `b` to
/// the bit, and the rim of each equals particles of the other.
void expectSameSeam(const Patch& a, const Patch& b) {
  ASSERT_EQ(a.layers.size(), b.layers.size());
  for (std::size_t k = 0; k < a.layers.size(); ++k) {
    const ParticleLayer &left = a.layers[k], &right = b.layers[k];
    ASSERT_EQ(left.rows, right.rows);
    const auto last = static_cast<int>(left.columns) - 1;
    for (int j = -1; j <= static_cast<int>(left.rows); ++j) {
      EXPECT_EQ(left.beyond(last, j), right.beyond(0, j));
      EXPECT_EQ(left.beyond(last + 1, j), right.beyond(1, j));
      EXPECT_EQ(left.beyond(last - 1, j), right.beyond(-1, j));
    }
  }
}

void expectSameBorderAbove(const Patch& low, const Patch& high) {
  for (std::size_t k = 0; k < low.layers.size(); ++k)
    for (std::size_t i = 0; i < low.layers[k].columns; ++i)
      EXPECT_EQ(low.layers[k].at(i, low.layers[k].rows - 1), high.layers[k].at(i, 0));
}

TEST(PatchGrid, TilesAPlaneEvenly) {
  const PatchGridResult grid =
      makePatchGrid(slab(), {V3d(-1.5, -1, 0), V3d(1.5, -1, 0), V3d(1.5, 1, 0), V3d(-1.5, 1, 0)},
                    0.3, {.columns = 3, .rows = 2}, {.layers = 3});
  ASSERT_EQ(grid.patches.size(), 6u);
  for (std::size_t n = 0; n < 6; ++n) {
    const double x = -1.5 + static_cast<double>(n % 3), y = -1 + static_cast<double>(n / 3);
    EXPECT_LT((grid.patches[n].corners[0] - V3d(x, y, 0)).length(), support::doubleRounding(1));
    EXPECT_LT((grid.patches[n].corners[2] - V3d(x + 1, y + 1, 0)).length(),
              support::doubleRounding(1));
    EXPECT_EQ(grid.patches[n].height, 0.3);
    EXPECT_FALSE(grid.patches[n].mirrored);
  }
  EXPECT_NEAR(grid.report.uLength, 3, support::rounding(3));
  EXPECT_NEAR(grid.report.vLength, 2, support::rounding(2));
}

TEST(PatchGrid, NeighboursShareTheirBorders) {
  for (const LayerScheme scheme : {LayerScheme::Reduced, LayerScheme::Conforming}) {
    const PatchGridResult grid =
        makePatchGrid(support::makeBall(1, 0.05, 12), support::cap(0.7), 0.3,
                      {.columns = 2, .rows = 2}, {.layers = 3, .scheme = scheme});
    ASSERT_EQ(grid.patches.size(), 4u);
    expectSameSeam(grid.patches[0], grid.patches[1]);
    expectSameSeam(grid.patches[2], grid.patches[3]);
    expectSameBorderAbove(grid.patches[0], grid.patches[2]);
    expectSameBorderAbove(grid.patches[1], grid.patches[3]);
  }
}

TEST(PatchGrid, MirroredTilesAlternateTheirDirection) {
  const PatchGridResult grid =
      makePatchGrid(slab(), support::square(1), 0.3,
                    {.columns = 2, .rows = 2, .mirrorU = true, .mirrorV = true}, {.layers = 2});
  const ParticleLayer &first = grid.patches[0].layers[0], &second = grid.patches[1].layers[0],
                      &above = grid.patches[2].layers[0];
  const std::size_t last = first.columns - 1, top = first.rows - 1;
  for (std::size_t j = 0; j <= top; ++j) EXPECT_EQ(first.at(last, j), second.at(last, j));
  for (std::size_t i = 0; i <= last; ++i) EXPECT_EQ(first.at(i, top), above.at(i, top));
  EXPECT_FALSE(grid.patches[0].mirrored);
  EXPECT_TRUE(grid.patches[1].mirrored);
  EXPECT_TRUE(grid.patches[2].mirrored);
  EXPECT_FALSE(grid.patches[3].mirrored);
  // The rim of a rotated tile is rotated with it.
  EXPECT_EQ(second.beyond(static_cast<int>(last) + 1, 0), first.at(last - 1, 0));
}

TEST(PatchGrid, ShiftedRowsOfAnOpenGridHaveOneTileLess) {
  const PatchGridResult grid =
      makePatchGrid(slab(), support::square(1), 0.3, {.columns = 4, .rows = 2, .shift = 0.5},
                    {.layers = 2, .cells = {4, 4}});
  ASSERT_EQ(grid.patches.size(), 7u);
  EXPECT_NEAR(grid.patches[4].corners[0].x, -0.75, support::rounding(1));
  EXPECT_NEAR(grid.patches[6].corners[1].x, 0.75, support::rounding(1));
}

TEST(PatchGrid, ClosesAroundACylinder) {
  for (const LayerScheme scheme : {LayerScheme::Conforming, LayerScheme::Reduced}) {
    const PatchGridResult grid =
        makePatchGridAround(pipe(), V3d(0, 0, -1), V3d(0, 0, 1), 0, 0.4, {.columns = 8, .rows = 2},
                            {.layers = 3, .scheme = scheme});
    ASSERT_EQ(grid.patches.size(), 16u);
    for (std::size_t n = 0; n < 8; ++n) {
      expectSameSeam(grid.patches[n], grid.patches[(n + 1) % 8]);
      expectSameBorderAbove(grid.patches[n], grid.patches[n + 8]);
      const double angle = kPi / 4 * static_cast<double>(n);
      EXPECT_LT((grid.patches[n].corners[0] - V3d(std::cos(angle), std::sin(angle), -1)).length(),
                support::measured(2.08e-5));
      for (const ParticleLayer& layer : grid.patches[n].layers)
        for (const V3d& p : layer.positions)
          EXPECT_NEAR(std::hypot(p.x, p.y), 1 + layer.height, support::measured(3.56e-5));
    }
    EXPECT_NEAR(grid.report.uLength, 2 * kPi, support::measured(0.00646));
    EXPECT_NEAR(grid.report.vLength, 2, support::measured(5.33e-12));
  }
}

TEST(PatchGrid, GoesAroundAVaseAndShiftsRowsLikeBricks) {
  // A spindle, round about an inclined axis.
  const V3d along = V3d(1, 2, 2) / 3.0;
  const NarrowBand vase = support::sampleBand(
      [=](const V3d& p) {
        const double t = p.dot(along);
        return ((p - along * t).length() - (0.7 + 0.2 * std::cos(2 * t))) /
               std::sqrt(1 + 0.16 * std::sin(2 * t) * std::sin(2 * t));
      },
      {V3d(-2), V3d(2)}, 0.1, 4);
  const PatchGridResult grid = makePatchGridAround(
      vase, along * -1.2, along * 1.2, 0.3, 0.1, {.columns = 6, .rows = 2, .shift = 0.5},
      {.layers = 2, .scheme = LayerScheme::Conforming, .cells = {6, 8}});
  ASSERT_EQ(grid.patches.size(), 12u);
  for (std::size_t n = 0; n < 6; ++n) {
    expectSameSeam(grid.patches[6 + n], grid.patches[6 + (n + 1) % 6]);
    // A shifted tile begins in the middle of the tile below.
    const ParticleLayer &low = grid.patches[n].layers[0], &high = grid.patches[6 + n].layers[0];
    for (std::size_t i = 0; i <= 3; ++i) EXPECT_EQ(high.at(i, 0), low.at(i + 3, low.rows - 1));
    for (const V3d& p : low.positions)
      EXPECT_NEAR((p - along * p.dot(along)).length(), 0.7 + 0.2 * std::cos(2 * p.dot(along)),
                  support::measured(7.27e-5));
  }
  EXPECT_LT(grid.report.cellAreaVariation, support::measured(0.154));
}

TEST(PatchGrid, RefusesInvalidGrids) {
  const NarrowBand band = slab(), round = pipe();
  const auto square = support::square(1);
  const V3d low(0, 0, -1), high(0, 0, 1);
  EXPECT_THROW((void)makePatchGrid(band, square, 0.3, {.columns = 0}), levelset::UsageError);
  EXPECT_THROW((void)makePatchGrid(band, square, 0.3, {.columns = 2, .shift = 1}),
               levelset::UsageError);
  EXPECT_THROW((void)makePatchGrid(band, square, 0.3, {.columns = 2, .shift = NAN}),
               levelset::UsageError);
  EXPECT_THROW((void)makePatchGrid(band, square, -1, {.columns = 2}), levelset::UsageError);
  EXPECT_THROW(
      (void)makePatchGrid(band, square, 0.3, {.columns = 300, .rows = 300}, {.spacing = 1e-3}),
      levelset::ResourceLimit);
  EXPECT_THROW((void)makePatchGridAround(round, low, high, 0, 0.1, {.columns = 2}),
               levelset::UsageError);
  EXPECT_THROW((void)makePatchGridAround(round, low, high, 0, 0.1, {.columns = 5, .mirrorU = true}),
               levelset::UsageError);
  EXPECT_THROW((void)makePatchGridAround(round, low, low, 0, 0.1, {.columns = 4}),
               levelset::UsageError);
  EXPECT_THROW((void)makePatchGridAround(round, low, V3d(NAN), 0, 0.1, {.columns = 4}),
               levelset::UsageError);
  EXPECT_THROW((void)makePatchGridAround(round, low, high, 0, 0.1, {.columns = 4},
                                         {.scheme = LayerScheme::Spline}),
               levelset::UsageError);
  // Beyond the ends of the cylinder and beside it there is no surface.
  EXPECT_THROW((void)makePatchGridAround(round, low, V3d(0, 0, 3), 0, 0.1, {.columns = 4}),
               levelset::InvalidInput);
  EXPECT_THROW(
      (void)makePatchGridAround(round, V3d(5, 0, -1), V3d(5, 0, 1), 0, 0.1, {.columns = 4}),
      levelset::InvalidInput);
  EXPECT_THROW((void)makePatchGridAround(NarrowBand(), low, high, 0, 0.1, {.columns = 4}),
               levelset::InvalidInput);
}

TEST(PatchMesh, OfOffsetLayersIsClosedAndHasThePatchsVolume) {
  const auto patch = mapping::makePatch(support::makeBall(1, 0.05, 16), support::cap(0.6), 0.5,
                                        {.layers = 4, .spacing = 0.08})
                         .patch;
  ASSERT_NE(patch.layers.front().columns, patch.layers.back().columns);
  const levelset::TriMesh mesh = mapping::patchMesh(patch);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(edges.count({edge.second, edge.first}), 1u);
  }
  std::vector<char> isUsed(mesh.positions.size(), 0);
  for (const auto& t : mesh.triangles)
    for (const auto v : t) isUsed[v] = 1;
  EXPECT_EQ(std::count(isUsed.begin(), isUsed.end(), 0), 0);
  // A pyramid over a spherical square: its solid angle, from four corners on the unit sphere.
  const V3d a = patch.corners[0], b = patch.corners[1], c = patch.corners[2];
  const double half = 2 * std::atan2(a.dot(b.cross(c)), 1 + a.dot(b) + b.dot(c) + c.dot(a));
  const double exact = 2 * half / 3 * (1.5 * 1.5 * 1.5 - 1);
  EXPECT_NEAR(levelset::signedVolume(mesh), exact, support::measured(8.05e-4) * exact);
}

TEST(PatchMesh, OfSheetsHasEveryCell) {
  const auto patch = mapping::makePatch(slab(), support::square(1), 0.3, {.layers = 3}).patch;
  const levelset::TriMesh mesh = mapping::patchMesh(patch, mapping::PatchMeshKind::Sheets);
  EXPECT_NEAR(levelset::surfaceArea(mesh), 3 * 4, support::doubleRounding(400));
  std::size_t cells = 0;
  for (const ParticleLayer& layer : patch.layers) cells += (layer.columns - 1) * (layer.rows - 1);
  EXPECT_EQ(mesh.triangles.size(), 2 * cells);
  const auto mirrored =
      mapping::makePatch(slab(), {V3d(-1, -1, 0), V3d(-1, 1, 0), V3d(1, 1, 0), V3d(1, -1, 0)}, 0.3,
                         {.layers = 3, .mirror = true})
          .patch;
  EXPECT_NEAR(levelset::signedVolume(mapping::patchMesh(mirrored)), 4 * 0.3,
              support::doubleRounding(25));
}

}  // namespace patch_grid_test
