// A knurl around a complete cylinder: patches that close, a texture that continues across their
// borders, and comparison with the exact relief.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "levelset/grids/sample.h"
#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"
#include "mapping/generators/knurl.h"
#include "mapping/placement/patch_grid.h"
#include "mapping/placement/shared_particles.h"
#include "mapping/textures/geometric_texture.h"
#include "mapping/untangle/untangle.h"
#include "tests/support/measured.h"

namespace knurled_cylinder_test {

using Imath::V3d;
using levelset::NarrowBand;
using mapping::Knurl;
using mapping::TextureMap;

// The ends of the cylinder, at 1.525, lie between two planes of grid points.
constexpr double kVoxel = 0.05, kHalfLength = 0.6, kHeight = 0.2, kSink = 0.05;
// A quarter turn maps the grid to itself, so that differences between tiles do not come from the
// grid.
constexpr std::size_t kTiles = 4, kRows = 2;
constexpr int kAngles = 360;

Knurl knurl() {
  Knurl knurl{.pitch = 1, .depth = 0.2, .flankAngle = 2, .base = 0.3, .tiling = {2, 1, 0.15}};
  knurl.grooveAngle = std::numbers::pi / 4;
  return knurl;
}

/// Radius of the relief, from its height at the position in the tile.
double exactRadius(double angle, double z) {
  const Knurl shape = knurl();
  const V3d size = mapping::knurlBox(shape, V3d(0)).tile.size();
  const double x = angle * kTiles / (2 * std::numbers::pi) * size.x,
               y = z * kRows / (2 * kHalfLength) * size.y;
  double height = size.z;
  for (const double way : {-1.0, 1.0}) {
    const double along = x * std::cos(shape.grooveAngle) + way * y * std::sin(shape.grooveAngle);
    const double flank =
        std::abs(std::remainder(along, shape.pitch)) / std::tan(shape.flankAngle / 2);
    height = std::min(height, size.z - shape.depth + flank);
  }
  return 1 - kSink + kHeight * height / size.z;
}

/// Radius of the surface on a ray from the axis.
double radiusOf(const levelset::BandSampler& sampler, double angle, double z) {
  double low = 0.9, high = 1.4;
  for (int n = 0; n < 30; ++n) {
    const double r = (low + high) / 2;
    (sampler.value(V3d(r * std::cos(angle), r * std::sin(angle), z)) < 0 ? low : high) = r;
  }
  return (low + high) / 2;
}

/// @param change  applied to the patches first
void expectKnurled(
    TextureMap map,
    const std::function<void(const NarrowBand&, std::vector<mapping::Patch>&)>& change = {}) {
  const NarrowBand base = levelset::makeCylinder(1, 3.05, V3d(0), V3d(0, 0, 1), kVoxel);
  mapping::PatchGridResult grid = mapping::makePatchGridAround(
      base, V3d(0, 0, -kHalfLength), V3d(0, 0, kHalfLength), 0, kHeight,
      {.columns = kTiles, .rows = kRows},
      {.layers = 3, .scheme = mapping::LayerScheme::Conforming, .spacing = 0.15});
  if (change) change(base, grid.patches);
  const NarrowBand texture = mapping::makeKnurl(knurl(), V3d(0), 0.04);
  const NarrowBand result =
      mapping::mapTexture(base, texture, grid.patches,
                          {.map = map,
                           .embedDepth = kSink,
                           .textureBox = mapping::knurlBox(knurl(), V3d(0)).tile,
                           .voxelSize = kVoxel})
          .band;
  const levelset::Measurement measured = levelset::measure(result);
  EXPECT_EQ(measured.components, 1u);
  EXPECT_EQ(measured.cavities, 0u);
  EXPECT_EQ(measured.euler, 2);

  if (change) return;  // the relief is changed
  const levelset::BandSampler sampler(result, levelset::Interpolation::Tricubic);
  double worst = 0, mostUneven = 0;
  V3d at(0);
  for (int k = -11; k <= 11; ++k) {
    const double z = kVoxel * k;
    std::array<double, kAngles> radii;
    for (int n = 0; n < kAngles; ++n) {
      const double angle = 2 * std::numbers::pi * n / kAngles;
      const double radius = radiusOf(sampler, angle, z);
      radii[static_cast<std::size_t>(n)] = radius;
      const double error = std::abs(radius - exactRadius(angle, z));
      if (error > worst) worst = error, at = V3d(n, z, radius);
    }
    for (std::size_t n = 0; n < kAngles; ++n)
      mostUneven =
          std::max(mostUneven, std::abs(radii[(n + kAngles / kTiles) % kAngles] - radii[n]));
  }
  EXPECT_LE(mostUneven, support::measured(0.00442) * kVoxel);
  EXPECT_LE(worst, support::measured(0.139) * kVoxel) << "at degrees, z, radius " << at;
}

TEST(KnurledCylinder, ClosesBySmoothMaps) {
  expectKnurled(TextureMap::Rbf);
}

TEST(KnurledCylinder, ClosesByTetrahedra) {
  expectKnurled(TextureMap::Prism);
}

TEST(KnurledCylinder, StaysClosedWhenItsPatchesAreRelaxed) {
  // Each patch is relaxed separately. Then their common particles are joined again.
  expectKnurled(TextureMap::Rbf, [](const NarrowBand& base, std::vector<mapping::Patch>& patches) {
    const std::vector<mapping::Patch> before = patches;
    for (mapping::Patch& patch : patches)
      patch = mapping::minimiseDistortion(
                  base, patch,
                  {.embedDepth = kSink / kHeight,
                   .proportions = mapping::knurlBox(knurl(), V3d(0)).tile.size()})
                  .patch;
    double apart = 0, moved = 0;
    const auto& left = patches[0].layers.back();
    for (std::size_t j = 0; j < left.rows; ++j) {
      const std::size_t n = j * left.columns + left.columns - 1;
      moved = std::max(moved, (left.positions[n] - before[0].layers.back().positions[n]).length());
    }
    const auto& right = patches[1].layers.back();
    double parted = 0;
    for (std::size_t j = 0; j < left.rows; ++j)
      parted = std::max(parted, (left.at(left.columns - 1, j) - right.at(0, j)).length());
    EXPECT_GT(parted, 1e-6);
    mapping::joinSharedParticles(before, patches);
    for (std::size_t j = 0; j < left.rows; ++j)
      apart = std::max(apart, (left.at(left.columns - 1, j) - right.at(0, j)).length());
    EXPECT_GT(moved, 1e-4);
    EXPECT_LE(apart, support::doubleRounding(4));
  });
}

}  // namespace knurled_cylinder_test
