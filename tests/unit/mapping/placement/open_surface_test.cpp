#include <gtest/gtest.h>

#include <cmath>

#include "levelset/convert/surface_band.h"
#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "mapping/generators/heightmap.h"
#include "mapping/placement/decal.h"
#include "mapping/placement/make_patch.h"
#include "mapping/placement/patch_grid.h"
#include "mapping/placement/scatter.h"
#include "mapping/surface/surface_projection.h"
#include "mapping/textures/geometric_texture.h"
#include "mapping/textures/mesh_texture.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/meshes.h"
#include "tests/support/patches.h"

namespace open_surface_test {

using Imath::M44d;
using Imath::V3d;
using levelset::InvalidInput;
using levelset::NarrowBand;
using levelset::TriMesh;
using mapping::makePatch;
using mapping::ParticleLayer;
using mapping::Patch;
using support::patchMesh;
using support::refusal;
using support::square;

constexpr double kVoxel = 0.1;

/// Surface z = height(x, y) over [−half, half]².
TriMesh terrain(double half, unsigned cells, const std::function<double(double, double)>& height) {
  return patchMesh(cells + 1, cells + 1, false, false, [=](double s, double t) {
    const double x = half * (2 * s - 1), y = half * (2 * t - 1);
    return V3d(x, y, height(x, y));
  });
}

NarrowBand plane(double half = 2, double halfWidth = 12) {
  return levelset::surfaceBand(terrain(half, 4, [](double, double) { return 0.0; }), kVoxel,
                               {.halfWidth = halfWidth})
      .band;
}

TEST(OpenSurface, PatchOnAPlaneEqualsThatOnABox) {
  const NarrowBand box = levelset::makeBox(V3d(4, 4, 2), V3d(0, 0, -1), kVoxel);
  const std::array<V3d, 4> corners = {V3d(-1, -0.7, 0.02), V3d(1.1, -0.5, 0), V3d(0.9, 0.8, 0),
                                      V3d(-1, 0.5, 0)};
  for (const auto scheme : {mapping::LayerScheme::Reduced, mapping::LayerScheme::Conforming,
                            mapping::LayerScheme::Spline}) {
    const mapping::PatchOptions options = {.layers = 3, .scheme = scheme, .spacing = 0.3};
    const Patch patch = makePatch(plane(), corners, 0.5, options).patch;
    const Patch truth = makePatch(box, corners, 0.5, options).patch;
    ASSERT_EQ(patch.layers.size(), truth.layers.size());
    for (std::size_t k = 0; k < patch.layers.size(); ++k) {
      ASSERT_EQ(patch.layers[k].positions.size(), truth.layers[k].positions.size());
      for (std::size_t n = 0; n < patch.layers[k].positions.size(); ++n)
        EXPECT_LT((patch.layers[k].positions[n] - truth.layers[k].positions[n]).length(),
                  support::rounding(1) * kVoxel);
    }
  }
}

/// Half a cylinder around the y axis, open below and at its ends, facing outwards.
TriMesh halfCylinder(double radius, double length) {
  return patchMesh(200, 3, false, false, [=](double u, double v) {
    const double a = M_PI * (u - 0.5);
    return V3d(radius * std::sin(a), length * (v - 0.5), radius * std::cos(a));
  });
}

TEST(OpenSurface, PatchOnHalfACylinderIsExact) {
  // Chords of 200 cells have a sagitta of 6e-5. Rows run around the cylinder, columns along it,
  // layers outwards.
  const double radius = 2, height = 0.6, arc = 0.9;
  const NarrowBand band =
      levelset::surfaceBand(halfCylinder(radius, 4), kVoxel, {.halfWidth = 13}).band;
  const auto at = [&](double a, double y) {
    return V3d(radius * std::sin(a), y, radius * std::cos(a));
  };
  const Patch patch =
      makePatch(band, {at(-arc, -1), at(arc, -1), at(arc, 1), at(-arc, 1)}, height, {.layers = 4})
          .patch;
  for (const ParticleLayer& layer : patch.layers)
    for (std::size_t j = 0; j < layer.rows; ++j)
      for (std::size_t i = 0; i < layer.columns; ++i) {
        const V3d p = layer.at(i, j);
        const double u = static_cast<double>(i) / static_cast<double>(layer.columns - 1),
                     v = static_cast<double>(j) / static_cast<double>(layer.rows - 1);
        const double r = std::hypot(p.x, p.z);
        EXPECT_NEAR(r, radius + layer.w * height, support::measured(1.05e-4) * height);
        EXPECT_NEAR(std::atan2(p.x, p.z) * r, arc * (2 * u - 1) * r,
                    support::measured(5.34e-5) * height);
        EXPECT_NEAR(p.y, 2 * v - 1, support::rounding(2) * height);
      }
}

TEST(OpenSurface, PatchesMayEndAtTheBorder) {
  const Patch patch = makePatch(plane(), square(2), 0.5, {.layers = 2}).patch;
  for (const ParticleLayer& layer : patch.layers)
    for (const V3d& p : layer.positions)
      EXPECT_NEAR(p.z, layer.height, support::doubleRounding(20) * kVoxel);
}

TEST(OpenSurface, PatchesOverTheBorderAreRefusedWithThePosition) {
  const NarrowBand band = plane();
  const std::string corner =
      refusal<InvalidInput>([&] { (void)makePatch(band, square(2.5), 0.5); });
  EXPECT_SAYS(corner, "the surface breaks off at about (-");
  EXPECT_SAYS(corner, "before the point (-2.5, -2.5, 0)");
  EXPECT_SAYS(
      refusal<InvalidInput>([&] { (void)mapping::cornersAround(band, V3d(1.5, 0, 0), 1.5, 1, 0); }),
      "the surface breaks off");
  EXPECT_SAYS(refusal<InvalidInput>(
                  [&] { (void)mapping::makeDecal(band, V3d(1.5, 0, 0), V3d(1, 0, 0), 1, 0.5); }),
              "breaks off");
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)makePatch(plane(2, 8), square(1), 0.9); }),
              "surface-band --half-width 15");
  // A spline needs no distances above the surface.
  EXPECT_GT(makePatch(plane(2, 5), square(1), 3, {.scheme = mapping::LayerScheme::Spline})
                .patch.particleCount(),
            0u);
}

TEST(OpenSurface, PatchesOverAHoleAreRefusedWithThePosition) {
  TriMesh sheet = terrain(2, 20, [](double, double) { return 0.0; });
  std::erase_if(sheet.triangles, [&](const auto& t) {
    const V3d middle =
        (sheet.positions[t[0]] + sheet.positions[t[1]] + sheet.positions[t[2]]) / 3.0;
    return std::abs(middle.x - 0.1) < 0.4 && std::abs(middle.y - 0.3) < 0.4;
  });
  const NarrowBand band = levelset::surfaceBand(sheet, 0.05, {.halfWidth = 17}).band;
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)makePatch(band, square(1.5), 0.5); }),
              "the surface breaks off at (");
  const std::array<V3d, 4> beside = {V3d(-1.8, -1.8, 0), V3d(1.8, -1.8, 0), V3d(1.8, -0.4, 0),
                                     V3d(-1.8, -0.4, 0)};
  EXPECT_GT(makePatch(band, beside, 0.5).patch.particleCount(), 0u);
}

TEST(OpenSurface, PatchesOverASlitAreRefused) {
  // The continuations of both sides of the slit meet. The band is complete, the surface is not.
  for (const double width : {4.0, 5.0, 6.0}) {
    TriMesh sheet = terrain(2, 4, [](double, double) { return 0.0; });
    TriMesh halves;
    for (const double side : {-1.0, 1.0}) {
      TriMesh half = sheet;
      for (V3d& p : half.positions) p = V3d(p.x + side * (2 + width * kVoxel / 2), p.y, p.y);
      append(halves, half);
    }
    const NarrowBand band = levelset::surfaceBand(halves, kVoxel, {.halfWidth = 8}).band;
    const mapping::PatchOptions options = {.scheme = mapping::LayerScheme::Spline};
    const auto over = [&](double x) {
      std::array<V3d, 4> corners = square(0.5);
      for (V3d& p : corners) p = V3d(p.x + x, p.y, p.y);
      return makePatch(band, corners, 0.3, options);
    };
    EXPECT_SAYS(refusal<InvalidInput>([&] { (void)over(0.07); }), "the surface breaks off at (");
    EXPECT_GT(over(0.5 + width * kVoxel / 2).patch.particleCount(), 0u);
  }
}

TEST(OpenSurface, PatchesMayEndAtTheCornersOfTiltedSheets) {
  const M44d turn = M44d().setEulerAngles(V3d(0.7, 0.5, 0.3));
  TriMesh sheet = terrain(1, 4, [](double, double) { return 0.0; });
  std::array<V3d, 4> corners = square(1);
  const V3d shift(0.013, 0.027, 0.041);
  for (V3d& p : sheet.positions) p = p * turn + shift;
  for (V3d& p : corners) p = p * turn + shift;
  const NarrowBand band = levelset::surfaceBand(sheet, kVoxel, {.halfWidth = 9}).band;
  const Patch patch = makePatch(band, corners, 0.3, {.layers = 2}).patch;
  V3d normal;
  turn.multDirMatrix(V3d(0, 0, 1), normal);
  for (const ParticleLayer& layer : patch.layers)
    for (const V3d& p : layer.positions)
      EXPECT_NEAR((p - shift).dot(normal), layer.height, support::rounding(0.25) * kVoxel);
}

TEST(OpenSurface, ClosestPointsLieOnTheSurface) {
  const NarrowBand band = plane();
  EXPECT_LT((mapping::closestSurfacePoint(band, V3d(0.3, 1.9, 5)) - V3d(0.3, 1.9, 0)).length(),
            support::doubleRounding(20) * kVoxel);
  EXPECT_LT((mapping::closestSurfacePoint(band, V3d(0.3, 1.9, -4)) - V3d(0.3, 1.9, 0)).length(),
            support::doubleRounding(20) * kVoxel);
  EXPECT_THROW((void)mapping::closestSurfacePoint(band, V3d(0, 2.4, 0)), InvalidInput);
  EXPECT_THROW((void)mapping::closestSurfacePoint(band, V3d(0, 2.4, 2)), InvalidInput);
}

TEST(OpenSurface, CarriesTextures) {
  const NarrowBand band = plane();
  const Patch patch = makePatch(band, square(1), 0.5, {.layers = 2, .spacing = 0.4}).patch;
  const NarrowBand ball = support::makeBall(1, kVoxel);
  const NarrowBand alone =
      mapping::mapTexture(band, ball, patch, {.merge = mapping::TextureMerge::Alone}).band;
  EXPECT_FALSE(alone.isOpenSurface());
  // The ball's cube becomes a box of 2 x 2 x 0.5, embedded by a voxel.
  const Imath::Box3d bounds = alone.zeroSetBounds();
  EXPECT_NEAR(bounds.min.z, -kVoxel, support::doubleRounding(6) * kVoxel);
  EXPECT_NEAR(bounds.max.z, 0.5 - kVoxel, support::measured(4.83e-14) * kVoxel);
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)mapping::mapTexture(band, ball, patch); }),
              "the base is an open surface");
  EXPECT_SAYS(refusal<InvalidInput>([&] {
                (void)mapping::mapTexture(ball, band, patch,
                                          {.merge = mapping::TextureMerge::Alone});
              }),
              "open surface");
}

TEST(OpenSurface, TreesStandOnTerrain) {
  // Vertical trunks on hills, with the spline scheme, mapped as meshes.
  const auto hills = [](double x, double y) { return 0.4 * std::sin(1.3 * x) * std::cos(y); };
  const NarrowBand band = levelset::surfaceBand(terrain(4, 80, hills), kVoxel).band;
  mapping::ScatterOptions options;
  options.density.count = 12;
  options.density.seed = 7;
  options.uSize = options.vSize = 0.5;
  options.patch.layers = 3;
  options.patch.spacing = 0.15;
  options.patch.scheme = mapping::LayerScheme::Spline;
  const mapping::ScatterResult forest = mapping::scatter(band, 1, options);
  ASSERT_EQ(forest.patches.size(), 12u);
  for (const Patch& patch : forest.patches)
    for (const V3d& p : patch.layers.front().positions) {
      EXPECT_LE(std::max(std::abs(p.x), std::abs(p.y)), 4 + kVoxel);
      // Facets of 0.1 by 0.1 with curvatures of up to 0.7 have a sagitta of up to 0.002. Beyond the
      // border the hills continue straight.
      const bool isBeyond = std::max(std::abs(p.x), std::abs(p.y)) > 4;
      EXPECT_NEAR(p.z, hills(p.x, p.y), 0.004 + (isBeyond ? 0.5 * 0.7 * kVoxel * kVoxel : 0));
    }
  const TriMesh trunk = support::sphereMesh(0.5, V3d(0.5), 6);
  const TriMesh trees = mapping::mapMesh(trunk, forest.patches).mesh;
  EXPECT_EQ(trees.triangles.size(), 12 * trunk.triangles.size());
  EXPECT_GT(levelset::signedVolume(trees), 0);
}

TEST(OpenSurface, SheetsOfHeightmapsPassThroughTheirPixels) {
  mapping::Heightmap map;
  map.grid = {3, 3, {0, 0.2, 0, 0.3, 1, 0.1, 0, 0.4, 0}};
  map.size = {4, 2};
  map.height = 1.5;
  map.base = 0.5;
  const V3d center(1, 2, 3);
  const TriMesh sheet = mapping::heightmapSheet(map, center, 0.5);
  ASSERT_EQ(sheet.positions.size(), 9u * 5u);
  ASSERT_EQ(sheet.attributes.uvs.size(), sheet.positions.size());
  for (std::size_t n = 0; n < sheet.positions.size(); ++n) {
    const Imath::V2d uv = sheet.attributes.uvs[n];
    EXPECT_NEAR(sheet.positions[n].x, 1 + 4 * (uv.x - 0.5), support::doubleRounding(12.5));
    EXPECT_NEAR(sheet.positions[n].y, 2 + 2 * (uv.y - 0.5), support::doubleRounding(12.5));
    EXPECT_NEAR(sheet.positions[n].z, 3 - 1 + 0.5 + 1.5 * mapping::heightAt(map, uv.x, uv.y),
                support::doubleRounding(20));
  }
  // The pixel in the middle of the first row has the largest y.
  EXPECT_NEAR(sheet.positions[4 * 9 + 4].z, 2.5 + 1.5 * 0.2, support::doubleRounding(12.5));
  for (const auto& t : sheet.triangles)
    EXPECT_GT((sheet.positions[t[1]] - sheet.positions[t[0]])
                  .cross(sheet.positions[t[2]] - sheet.positions[t[0]])
                  .z,
              0);
  EXPECT_EQ(levelset::surfaceBand(sheet, 0.1).borderEdges, 2u * (8 + 4));
  EXPECT_THROW((void)mapping::heightmapSheet(map, center, 0), levelset::UsageError);
  EXPECT_THROW((void)mapping::heightmapSheet(map, center, 1e-4, {.maxMemory = 1000}),
               levelset::ResourceLimit);
}

TEST(OpenSurface, TilesGoAroundAPipe) {
  // A pipe of zero thickness, open at both ends.
  const TriMesh pipe = patchMesh(100, 3, true, false, [](double u, double v) {
    const double a = 2 * M_PI * u;
    return V3d(std::cos(a), std::sin(a), 4 * v - 2);
  });
  const NarrowBand band = levelset::surfaceBand(pipe, kVoxel, {.halfWidth = 10}).band;
  const mapping::PatchGridResult grid = mapping::makePatchGridAround(
      band, V3d(0, 0, -1), V3d(0, 0, 1), 0, 0.3, {.columns = 4, .rows = 2}, {.layers = 2});
  ASSERT_EQ(grid.patches.size(), 8u);
  for (const Patch& tile : grid.patches)
    for (const ParticleLayer& layer : tile.layers)
      for (const V3d& p : layer.positions)
        EXPECT_NEAR(std::hypot(p.x, p.y), 1 + layer.height, support::measured(0.00489) * kVoxel);
}

}  // namespace open_surface_test
