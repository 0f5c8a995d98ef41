// Shells of textures that stay apart from the base.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "mapping/maps/prism_map.h"
#include "mapping/placement/make_patch.h"
#include "mapping/placement/patch_grid.h"
#include "mapping/textures/texture_shells.h"
#include "tests/support/measured.h"

namespace texture_shells_test {

using Imath::Box3d;
using Imath::V3d;
using levelset::NarrowBand;
using namespace mapping;

const TextureOptions kPrisms = {.map = TextureMap::Prism, .embedDepth = 0.3};

NarrowBand ball() {
  return levelset::makeSphere(10, V3d(0), 0.5);
}

Patch patchOn(const NarrowBand& base) {
  return makePatch(base, {V3d(-3, -3, 9), V3d(3, -3, 9), V3d(3, 3, 9), V3d(-3, 3, 9)}, 2,
                   {.layers = 3, .spacing = 0.75})
      .patch;
}

TEST(TextureShells, HaveTheNodesOfThePrismMap) {
  const NarrowBand base = ball(),
                   ring = levelset::makeTorus(2, 0.6, V3d(1, 2, 3), V3d(0, 0, 1), 0.1);
  const Patch patch = patchOn(base);
  const PlacedTexture placed = placeTexture(base, ring, std::array{patch, patch}, kPrisms);
  ASSERT_EQ(placed.groups.size(), 1u);
  ASSERT_EQ(placed.groups[0].shells.size(), 2u);
  EXPECT_EQ(placed.groups[0].texture.contentHash(), ring.contentHash());
  EXPECT_EQ(placed.report.patches, 2u);
  EXPECT_EQ(placed.report.certificate.verdict(), FoldVerdict::Certified);
  const TextureShell& shell = placed.groups[0].shells[0];
  const Box3d box = ring.zeroSetBounds();
  const PrismMap map(patch, {.embedDepth = 0.3 / patch.height, .rim = 1});
  double worst = 0;
  std::size_t inside = 0, n = 0;
  for (const double z : shell.coordinates[2])
    for (const double y : shell.coordinates[1])
      for (const double x : shell.coordinates[0]) {
        V3d uvw = (V3d(x, y, z) - box.min) / box.size() - V3d(0, 0, 0.3 / patch.height);
        for (int a = 0; a < 3; ++a) uvw[a] = std::round(uvw[a] * 1e9) / 1e9;  // the sides exactly
        const V3d position = shell.centre + V3d(shell.offsets[n++]);
        if (!map.holdsTexture(uvw)) continue;
        ++inside;
        worst = std::max(worst, (map.toPatch(uvw) - position).length());
      }
  EXPECT_EQ(n, shell.offsets.size());
  // Every layer has as many nodes as the largest has particles.
  std::size_t largest = 0;
  for (const ParticleLayer& layer : patch.layers)
    largest = std::max(largest, layer.positions.size());
  EXPECT_GE(inside, largest * patch.layers.size());
  EXPECT_LT(worst, support::rounding(2));  // half a spacing of floats on each axis
  // The outer cells reach a voxel of the texture beyond it.
  for (int a = 0; a < 3; ++a) {
    const auto& along = shell.coordinates[static_cast<std::size_t>(a)];
    EXPECT_NEAR(box.min[a] - along.front(), 0.1, 1e-6) << a;
    // The lattice ends above the top layer, and the texture is lower by the embedding depth.
    const double lowered = a == 2 ? 0.3 / patch.height * box.size().z : 0;
    EXPECT_NEAR(along.back() - box.max[a], 0.1 + lowered, 1e-6) << a;
  }
}

TEST(TextureShells, ShareOneCopyOfEachClippedPart) {
  const NarrowBand base = levelset::makeCylinder(5, 12, V3d(0), V3d(0, 0, 1), 0.25),
                   plate = levelset::makeBox(V3d(4, 4, 1), V3d(0), 0.1);
  const PatchGridResult grid = makePatchGridAround(base, V3d(0, 0, -3), V3d(0, 0, 3), 0, 0.8,
                                                   {.columns = 5, .rows = 3}, {.layers = 2});
  TextureOptions options = kPrisms;
  options.textureBox = Box3d(V3d(-1, -1, -0.5), V3d(1, 1, 0.5));
  const PlacedTexture placed = placeTexture(base, plate, grid.patches, options);
  // Tiles of the first, the middle and the last row have different shared sides.
  ASSERT_EQ(placed.groups.size(), 3u);
  for (const ShellGroup& group : placed.groups) {
    EXPECT_EQ(group.shells.size(), 5u);
    // Clipped at least two voxels beyond both shared sides along u.
    EXPECT_LT(group.texture.zeroSetBounds().size().x, 3);
    EXPECT_GT(group.texture.zeroSetBounds().size().x, 2.39);
  }
}

TEST(TextureShells, AreRefusedWithoutAMergedGrid) {
  const NarrowBand base = ball(), ring = levelset::makeTorus(2, 0.6, V3d(0), V3d(0, 0, 1), 0.2);
  const std::vector<Patch> patches = {patchOn(base)};
  TextureOptions rbf = kPrisms, carve = kPrisms;
  rbf.map = TextureMap::Rbf;
  carve.merge = TextureMerge::Carve;
  EXPECT_THROW((void)placeTexture(base, ring, patches, rbf), levelset::UsageError);
  EXPECT_THROW((void)placeTexture(base, ring, patches, carve), levelset::UsageError);
  EXPECT_THROW((void)placeTexture(base, ring, {}, kPrisms), levelset::UsageError);
  EXPECT_THROW((void)placeTexture(levelset::makeSphere(4, V3d(0), 0.5), ring, patches, kPrisms),
               levelset::InvalidInput);
}

}  // namespace texture_shells_test
