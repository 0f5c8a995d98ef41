#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/mesh.h"
#include "mapping/placement/make_patch.h"
#include "mapping/textures/geometric_texture.h"
#include "mapping/textures/mesh_texture.h"
#include "tests/support/measured.h"
#include "tests/support/patches.h"
#include "tests/support/threads.h"

namespace many_patches_test {

using Imath::V3d;
using levelset::NarrowBand;
using mapping::mapTexture;
using mapping::Patch;
using mapping::TextureMerge;
using support::makeBall;

constexpr double kVoxel = 0.1, kRadius = 3;

/// Patch on a ball, at an angle from +x towards +y.
Patch patchAt(const NarrowBand& ball, double angle, double side = 1) {
  const V3d place(kRadius * std::cos(angle), kRadius * std::sin(angle), 0);
  const auto corners = mapping::cornersAround(ball, place, side, side);
  return mapping::makePatch(ball, corners, 0.6, {.layers = 3}).patch;
}

NarrowBand stud() {
  return makeBall(0.8, kVoxel);
}

TEST(ManyPatches, EqualTheUnionOfEach) {
  const NarrowBand ball = makeBall(kRadius, kVoxel);
  std::vector<Patch> patches;
  for (int n = 0; n < 5; ++n) patches.push_back(patchAt(ball, 2 * M_PI * n / 5));
  const mapping::TextureOptions alone = {.merge = TextureMerge::Alone, .voxelSize = kVoxel};
  const mapping::TextureResult all = mapTexture(ball, stud(), patches, alone);
  EXPECT_EQ(all.report.patches, 5u);
  const levelset::Measurement many = levelset::measure(all.band);
  EXPECT_EQ(many.components, 5u);
  double volume = 0;
  std::size_t particles = 0;
  for (const Patch& patch : patches) {
    const mapping::TextureResult one = mapTexture(ball, stud(), patch, alone);
    volume += levelset::measure(one.band).volume;
    particles += one.report.particles;
    // Every texture is at its position: the union with it changes nothing.
    const NarrowBand both = levelset::unite(all.band, one.band);
    EXPECT_NEAR(levelset::measure(both).volume, many.volume, support::rounding(1) * many.volume);
  }
  EXPECT_NEAR(many.volume, volume, support::doubleRounding(1.5) * volume);
  EXPECT_EQ(all.report.particles, particles);

  const levelset::Measurement joined = levelset::measure(
      mapTexture(ball, stud(), patches, {.embedDepth = 0.2, .voxelSize = kVoxel}).band);
  EXPECT_EQ(joined.components, 1u);
  EXPECT_GT(joined.volume, levelset::measure(ball).volume);
  const levelset::Measurement carved = levelset::measure(
      mapTexture(ball, stud(), patches,
                 {.merge = TextureMerge::Carve, .embedDepth = 0.2, .voxelSize = kVoxel})
          .band);
  EXPECT_LT(carved.volume, levelset::measure(ball).volume);
}

TEST(ManyPatches, MayOverlap) {
  const NarrowBand ball = makeBall(kRadius, kVoxel);
  const std::vector<Patch> twice = {patchAt(ball, 0), patchAt(ball, 0)};
  const mapping::TextureOptions alone = {.merge = TextureMerge::Alone, .voxelSize = kVoxel};
  const NarrowBand one = mapTexture(ball, stud(), twice.front(), alone).band;
  EXPECT_EQ(mapTexture(ball, stud(), twice, alone).band.contentHash(), one.contentHash());
  const std::vector<Patch> beside = {patchAt(ball, 0), patchAt(ball, 0.2)};
  const levelset::Measurement both =
      levelset::measure(mapTexture(ball, stud(), beside, alone).band);
  EXPECT_EQ(both.components, 1u);
  EXPECT_LT(both.volume, 1.9 * levelset::measure(one).volume);
}

TEST(ManyPatches, UseTheFinestVoxelSizeOfTheirTextures) {
  const NarrowBand ball = makeBall(kRadius, kVoxel), texture = makeBall(0.8, 2 * kVoxel);
  const std::vector<Patch> patches = {patchAt(ball, 0, 1), patchAt(ball, 2, 0.4)};
  const mapping::TextureOptions alone = {.merge = TextureMerge::Alone};
  const mapping::TextureReport coarse = mapTexture(ball, texture, patches[0], alone).report;
  const mapping::TextureReport fine = mapTexture(ball, texture, patches[1], alone).report;
  ASSERT_LT(fine.voxelSize, coarse.voxelSize);
  const mapping::TextureReport both = mapTexture(ball, texture, patches, alone).report;
  EXPECT_EQ(both.voxelSize, fine.voxelSize);
  EXPECT_EQ(both.distortion.stretch.least,
            std::min(coarse.distortion.stretch.least, fine.distortion.stretch.least));
  EXPECT_EQ(both.distortion.samples, coarse.distortion.samples + fine.distortion.samples);
}

TEST(ManyPatches, SameBitsForAnyNumberOfThreads) {
  const NarrowBand ball = makeBall(kRadius, kVoxel);
  std::vector<Patch> patches;
  for (int n = 0; n < 3; ++n) patches.push_back(patchAt(ball, n));
  const auto hash = [&](std::size_t threads) {
    return support::onThreads(threads, [&] {
      return mapTexture(ball, stud(), patches, {.voxelSize = kVoxel}).band.contentHash();
    });
  };
  const std::uint64_t one = hash(1);
  EXPECT_EQ(hash(2), one);
  EXPECT_EQ(hash(5), one);
}

TEST(ManyPatches, OfMeshesAreAppendedInOrder) {
  const NarrowBand ball = makeBall(kRadius, kVoxel);
  const std::vector<Patch> patches = {patchAt(ball, 0), patchAt(ball, 2)};
  const levelset::TriMesh tile = {
      .positions = {V3d(0, 0, 0), V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)},
      .triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
  const levelset::TriMesh both = mapping::mapMesh(tile, patches).mesh;
  ASSERT_EQ(both.positions.size(), 8u);
  ASSERT_EQ(both.triangles.size(), 8u);
  double volume = 0;
  for (const Patch& patch : patches)
    volume += levelset::signedVolume(mapping::mapMesh(tile, patch).mesh);
  EXPECT_NEAR(levelset::signedVolume(both), volume, support::doubleRounding(1));
}

TEST(ManyPatches, RefuseAnEmptyList) {
  const NarrowBand ball = makeBall(kRadius, 0.2);
  const std::vector<Patch> none;
  EXPECT_THROW((void)mapTexture(ball, stud(), none), levelset::UsageError);
  EXPECT_THROW((void)mapping::mapMesh({.positions = {V3d(0)}, .triangles = {{0, 0, 0}}}, none),
               levelset::UsageError);
}

}  // namespace many_patches_test
