// Deformation of patches: closed forms, shared particles, particles that move onto a deformed base.

#include "mapping/placement/deform_patches.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "levelset/deform/cage/cage.h"
#include "levelset/deform/deform_band.h"
#include "levelset/deform/ready_lattices.h"
#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "mapping/placement/make_patch.h"
#include "mapping/placement/patch_grid.h"
#include "mapping/surface/surface_field.h"
#include "tests/support/measured.h"
#include "tests/support/patches.h"

namespace deform_patches_test {

using Imath::V3d;
using levelset::LatticeDeformation;
using mapping::deformPatches;
using mapping::DeformPatchesResult;
using mapping::ParticleLayer;
using mapping::Patch;

levelset::NarrowBand capsule(double voxel) {
  return levelset::makeCapsule({0, 0, -1.5}, {0, 0, 1.5}, 0.5, voxel);
}

Patch tile(const levelset::NarrowBand& base) {
  return mapping::makePatch(base, mapping::cornersAround(base, {0.5, 0, 0}, 0.4, 0.6), 0.2,
                            {.layers = 3})
      .patch;
}

const levelset::OrientedBox kBox{.halfSize = V3d(1, 1, 2.2)};

/// Largest distance of the particles of a deformed patch, with rims and corners, from a map of
/// those of the given one.
template <typename Map>
double largestError(const Patch& before, const Patch& after, const Map& map) {
  double worst = 0;
  const auto add = [&](const V3d& from, const V3d& to) {
    worst = std::max(worst, (map(from) - to).length());
  };
  for (std::size_t n = 0; n < 4; ++n) add(before.corners[n], after.corners[n]);
  for (std::size_t k = 0; k < before.layers.size(); ++k) {
    const ParticleLayer &from = before.layers[k], &to = after.layers[k];
    EXPECT_EQ(from.rim.size(), to.rim.size());
    for (std::size_t n = 0; n < from.positions.size(); ++n) add(from.positions[n], to.positions[n]);
    for (std::size_t n = 0; n < from.rim.size(); ++n) add(from.rim[n], to.rim[n]);
  }
  return worst;
}

TEST(DeformPatches, MoveAllParticlesByTheMap) {
  const Patch patch = tile(capsule(0.1));
  const levelset::ReadyLattice bend = levelset::bendLattice(kBox, 0.8, 1e-9);
  const DeformPatchesResult bent = deformPatches({&patch, 1}, LatticeDeformation(bend.lattice));
  EXPECT_LT(largestError(patch, bent.patches[0],
                         [](const V3d& p) { return levelset::bent(kBox, 0.8, p); }),
            1e-9);
  EXPECT_EQ(bent.certificate.verdict, levelset::FoldVerdict::Certified);
  EXPECT_EQ(bent.largestSnap, 0);
}

TEST(DeformPatches, ScaleTheHeightWithTheColumns) {
  const Patch patch = tile(capsule(0.1));
  // Columns at x = 0.5 rise along x, so a stretch along x lengthens them.
  const levelset::OrientedBox box{.directions = {V3d(0, 1, 0), V3d(0, 0, 1), V3d(1, 0, 0)},
                                  .halfSize = V3d(1, 2.2, 1)};
  const DeformPatchesResult wide =
      deformPatches({&patch, 1}, LatticeDeformation(levelset::stretchLattice(box, 1.5).lattice));
  const Patch& moved = wide.patches[0];
  EXPECT_NEAR(moved.height / patch.height, 1.5, 0.05);  // those at the sides rise obliquely
  EXPECT_LT(moved.height, 1.5 * patch.height);
  for (const ParticleLayer& layer : moved.layers)
    EXPECT_DOUBLE_EQ(layer.height, layer.w * moved.height);
  EXPECT_EQ(moved.spacing, meanSpacing(moved));
  // A stretch along z keeps the length of the columns.
  const DeformPatchesResult tall =
      deformPatches({&patch, 1}, LatticeDeformation(levelset::stretchLattice(kBox, 1.5).lattice));
  EXPECT_NEAR(tall.patches[0].height / patch.height, 1, 1e-3);
}

TEST(DeformPatches, KeepIdentitiesAndSharedParticles) {
  const levelset::NarrowBand base = capsule(0.1);
  const std::vector<Patch> tiles =
      mapping::makePatchGrid(base, mapping::cornersAround(base, {0.5, 0, 0}, 0.5, 1), 0.2,
                             {.columns = 2, .rows = 2}, {.layers = 3})
          .patches;
  const LatticeDeformation none(levelset::stretchLattice(kBox, 1).lattice);
  const std::vector<Patch> same = deformPatches(tiles, none).patches;
  for (std::size_t n = 0; n < tiles.size(); ++n) {
    EXPECT_EQ(largestError(tiles[n], same[n], [](const V3d& p) { return p; }), 0);
    EXPECT_EQ(tiles[n].height, same[n].height);
  }
  const std::vector<Patch> bent =
      deformPatches(tiles, LatticeDeformation(levelset::bendLattice(kBox, 0.8, 1e-9).lattice))
          .patches;
  // The last column of a tile is the first one of its neighbour.
  const ParticleLayer &left = bent[0].layers[1], &right = bent[1].layers[1];
  for (std::size_t row = 0; row < left.rows; ++row)
    EXPECT_EQ(left.at(left.columns - 1, row), right.at(0, row));
}

/// The deformed level set and the deformed particles differ by the error of the level set, which is
/// of second order or better.
TEST(DeformPatches, MoveOntoTheDeformedBase) {
  const LatticeDeformation map(levelset::bendLattice(kBox, 0.8, 1e-9).lattice);
  std::vector<double> snaps;
  for (const double voxel : {0.1, 0.05, 0.025}) {
    const levelset::NarrowBand base = capsule(voxel);
    const levelset::NarrowBand deformed = levelset::deformBand(base, map).band;
    const Patch patch = tile(base);
    const DeformPatchesResult result = deformPatches({&patch, 1}, map, {.onto = &deformed});
    snaps.push_back(result.largestSnap);
    const mapping::SurfaceField field(deformed);
    for (const V3d& p : result.patches[0].layers[0].positions)
      EXPECT_LT(std::abs(field.value(p)), 1e-4 * voxel);
    for (const V3d& p : result.patches[0].corners)
      EXPECT_LT(std::abs(field.value(p)), 1e-4 * voxel);
    // Upper layers stay where the map moves them.
    const DeformPatchesResult free = deformPatches({&patch, 1}, map);
    EXPECT_EQ(result.patches[0].layers[2].positions, free.patches[0].layers[2].positions);
  }
  RecordProperty("snaps", ::testing::PrintToString(snaps));
  EXPECT_GT(snaps[0], 0);
  EXPECT_LT(snaps[0], 0.002 * 0.1);
  EXPECT_GT(snaps[0] / snaps[1], 4);
  EXPECT_GT(snaps[1] / snaps[2], 4);
}

TEST(DeformPatches, MoveByCages) {
  const Patch patch = tile(capsule(0.1));
  levelset::TriMesh rest;
  for (const double z : {-3.0, 3.0})
    for (const double y : {-2.0, 2.0})
      for (const double x : {-2.0, 2.0}) rest.positions.emplace_back(x, y, z);
  rest.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  levelset::TriMesh moved = rest;
  for (V3d& p : moved.positions) p = V3d(1.2 * p.x + 0.1 * p.z, p.y, p.z);
  const levelset::CageDeformation cage(rest, moved, levelset::CageCoordinates::MeanValue);
  const DeformPatchesResult result = deformPatches({&patch, 1}, cage);
  EXPECT_TRUE(result.certificate.isInjective());
  EXPECT_GT(result.certificate.boxes, 0U);  // the space of the patch, and not its points alone
  EXPECT_LT(largestError(patch, result.patches[0],
                         [](const V3d& p) { return V3d(1.2 * p.x + 0.1 * p.z, p.y, p.z); }),
            1e-12);
}

TEST(DeformPatches, RefuseFoldsAndPlacesOutside) {
  const Patch patch = tile(capsule(0.1));
  const auto deform = [&](const levelset::OrientedBox& box, double angle) {
    return deformPatches({&patch, 1},
                         LatticeDeformation(levelset::bendLattice(box, angle, 1e-6).lattice));
  };
  EXPECT_THROW((void)deform(kBox, 5), levelset::InvalidInput);
  EXPECT_THROW((void)deform({.halfSize = V3d(0.5, 1, 2)}, 0.3), levelset::InvalidInput);
  const levelset::NarrowBand other = levelset::makeSphere(1, {}, 0.1);
  EXPECT_THROW((void)deformPatches({&patch, 1},
                                   LatticeDeformation(levelset::stretchLattice(kBox, 1).lattice),
                                   {.onto = &other}),
               levelset::InvalidInput);
  EXPECT_THROW((void)deformPatches({&patch, 1},
                                   LatticeDeformation(levelset::stretchLattice(kBox, 1).lattice),
                                   {.maxMemory = 1000}),
               levelset::ResourceLimit);
}

}  // namespace deform_patches_test
