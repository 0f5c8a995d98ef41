#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/meshing/band_to_mesh.h"
#include "mapping/maps/layer_map.h"
#include "mapping/maps/prism_map.h"
#include "mapping/placement/make_patch.h"
#include "mapping/textures/geometric_texture.h"
#include "mapping/textures/mesh_texture.h"
#include "tests/support/formula_patches.h"
#include "tests/support/measured.h"
#include "tests/support/patches.h"
#include "tests/support/threads.h"

namespace mesh_shell_test {

using Imath::Box3d;
using Imath::V3d;
using levelset::NarrowBand;
using levelset::TriMesh;
using mapping::MeshMap;
using mapping::Patch;
using support::patchAt;

const Box3d kUnitBox(V3d(0), V3d(1));

/// Triangles with random vertices in a box.
TriMesh randomMesh(const Box3d& box, std::uint32_t triangles) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  TriMesh mesh;
  for (std::uint32_t n = 0; n < triangles; ++n) {
    for (int corner = 0; corner < 3; ++corner)
      mesh.positions.push_back(box.min +
                               V3d(unit(random), unit(random), unit(random)) * box.size());
    mesh.triangles.push_back({3 * n, 3 * n + 1, 3 * n + 2});
  }
  return mesh;
}

/// Wavy part of a cylinder's wall.
V3d wavy(const V3d& p) {
  const double angle = 1.2 * (p.x - 0.5), r = 2 + 0.5 * p.z + 0.05 * std::sin(5 * p.y);
  return {r * std::sin(angle), 2 * p.y + 0.03 * std::sin(7 * p.x), r * std::cos(angle)};
}

V3d sheared(const V3d& p) {
  return {2 * p.x + p.z, 3 * p.y - 0.5 * p.x, p.z / 2 + 0.1 * p.y + 4};
}

/// Level set of a ball with the vertices of its mesh as a texture.
TriMesh ballMesh(double radius, double voxel) {
  return levelset::bandToMesh(support::makeBall(radius, voxel));
}

TEST(MeshShell, InverseMapLeadsBack) {
  // Also beyond the unit cube, where the outer cells continue the particles.
  for (const double beyond : {0.0, 0.4}) {
    const Box3d box(V3d(-beyond), V3d(1 + beyond));
    const TriMesh mesh = randomMesh(box, 300);
    const Patch patch = patchAt(wavy, 9, 7, 4, 0.5);
    const TriMesh moved =
        mapping::mapMesh(mesh, patch, {.map = MeshMap::Prisms, .textureBox = kUnitBox}).mesh;
    EXPECT_EQ(moved.triangles, mesh.triangles);
    const mapping::PrismMap inverse(patch, {.reach = levelset::bounds(mesh)});
    double worst = 0;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v)
      worst = std::max(worst, (inverse(moved.positions[v]) - mesh.positions[v]).length());
    EXPECT_LE(worst, support::doubleRounding(8)) << beyond;
  }
}

TEST(MeshShell, StraightPatchGivesAnAffineMap) {
  const Box3d box(V3d(-0.7, -0.1, -0.6), V3d(1.3, 1.9, 1.4));
  TriMesh mesh = randomMesh(box, 200);
  mesh.attributes.normals.assign(mesh.positions.size(), V3d(0.3, -2, 1));
  mesh.attributes.uvs.assign(mesh.positions.size(), Imath::V2d(0.5, 0.25));
  for (const double embedDepth : {0.0, 0.2, -0.2}) {
    const mapping::MeshTextureResult moved = mapping::mapMesh(
        mesh, patchAt(sheared, 5, 4, 3, 0.5),
        {.map = MeshMap::Prisms, .embedDepth = embedDepth, .textureBox = kUnitBox});
    // The normal of the image is that of M⁻ᵀ, for the slopes M of the map.
    const V3d a(2, -0.5, 0), b(0, 3, 0.1), c(1, 0, 0.5);
    const V3d normal = (b.cross(c) * 0.3 + c.cross(a) * -2 + a.cross(b) * 1).normalized();
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      const V3d uvw = mesh.positions[v] - V3d(0, 0, embedDepth / 0.5);
      EXPECT_LT((moved.mesh.positions[v] - sheared(uvw)).length(), support::doubleRounding(40));
      EXPECT_LT((moved.mesh.attributes.normals[v] - normal).length(), support::doubleRounding(40));
    }
    EXPECT_EQ(moved.mesh.attributes.uvs, mesh.attributes.uvs);
    EXPECT_NEAR(moved.distortion.jacobian.least, 1, support::doubleRounding(20));
    EXPECT_EQ(moved.certificate.verdict(), mapping::FoldVerdict::Certified);
    EXPECT_TRUE(moved.notes.empty());
  }
}

TEST(MeshShell, AgreesWithTheSolid) {
  const double radius = 2, voxel = 0.05;
  const NarrowBand base = support::makeBall(radius, voxel);
  const TriMesh ball = ballMesh(0.6, 0.04);
  const NarrowBand solid = levelset::meshToBand(ball, voxel).band;
  const Patch patch = mapping::makePatch(base, support::cap(0.6, radius), 0.6).patch;
  for (const double embedDepth : {voxel, 0.3}) {
    const mapping::MeshTextureResult moved =
        mapping::mapMesh(ball, patch, {.map = MeshMap::Prisms, .embedDepth = embedDepth});
    EXPECT_GT(levelset::signedVolume(moved.mesh), 0);
    const NarrowBand warped = mapping::mapTexture(base, solid, patch,
                                                  {.merge = mapping::TextureMerge::Alone,
                                                   .map = mapping::TextureMap::Prism,
                                                   .embedDepth = embedDepth,
                                                   .textureBox = levelset::bounds(ball),
                                                   .voxelSize = voxel})
                                  .band;
    const levelset::BandSampler toSolid(warped);
    double worst = 0;
    for (const V3d& p : moved.mesh.positions)
      worst = std::max(worst, std::abs(toSolid.value(p)) / voxel);
    EXPECT_LE(worst, support::measured(0.2)) << embedDepth;
    const NarrowBand filled = levelset::meshToBand(moved.mesh, voxel).band;
    const levelset::BandSampler toMesh(filled);
    worst = 0;
    for (const V3d& p : levelset::bandToMesh(warped).positions)
      worst = std::max(worst, std::abs(toMesh.value(p)) / voxel);
    EXPECT_LE(worst, support::measured(0.2)) << embedDepth;
  }
}

// Both maps interpolate the particles. Between these they differ by the twist of a cell.
TEST(MeshShell, MeetsTheLayerMapAtParticles) {
  const Patch patch = patchAt(wavy, 6, 5, 3, 0.5);
  TriMesh mesh;
  for (int k = 0; k < 3; ++k)
    for (int j = 0; j < 5; ++j)
      for (int i = 0; i < 6; ++i) mesh.positions.emplace_back(i / 5.0, j / 4.0, k / 2.0);
  for (std::uint32_t v = 0; v + 2 < mesh.positions.size(); ++v)
    mesh.triangles.push_back({v, v + 1, v + 2});
  const TriMesh moved = mapping::mapMesh(mesh, patch, {.map = MeshMap::Prisms}).mesh;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v)
    EXPECT_LT((moved.positions[v] - wavy(mesh.positions[v])).length(), support::doubleRounding(4));
}

TEST(MeshShell, ConvergesWithSecondOrder) {
  const TriMesh mesh = randomMesh(kUnitBox, 400);
  double before = 0;
  for (const std::size_t cells : {8, 16, 32}) {
    const TriMesh moved =
        mapping::mapMesh(mesh, patchAt(wavy, cells + 1, cells + 1, cells / 4 + 1, 0.5),
                         {.map = MeshMap::Prisms, .textureBox = kUnitBox})
            .mesh;
    double error = 0;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v)
      error = std::max(error, (moved.positions[v] - wavy(mesh.positions[v])).length());
    if (before > 0) {
      EXPECT_NEAR(std::log2(before / error), 2, support::measured(0.1)) << cells;
    }
    before = error;
  }
}

// The slopes that turn the normals are the derivatives of the map.
TEST(MeshShell, FrameHasTheDerivatives) {
  const mapping::PrismMap map(patchAt(wavy, 6, 5, 3, 0.5), {.embedDepth = 0.1, .rim = 0.05});
  const double step = 1e-6;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int n = 0; n < 200; ++n) {
    const V3d uvw(unit(random), unit(random), unit(random));
    const mapping::ForwardFrame frame = map.frame(uvw);
    EXPECT_EQ(frame.position, map.toPatch(uvw));
    for (int axis = 0; axis < 3; ++axis) {
      V3d ahead = uvw, behind = uvw;
      ahead[axis] += step, behind[axis] -= step;
      const V3d slope = (map.toPatch(ahead) - map.toPatch(behind)) / (2 * step);
      EXPECT_LT((frame.slopes[static_cast<std::size_t>(axis)] - slope).length(),
                support::measured(1e-9));
    }
  }
  EXPECT_TRUE(std::isnan(map.frame(V3d(0.5, 0.5, 9)).slopes[0].x));
}

TEST(MeshShell, KeepsTheOrientationOnAMirroredPatch) {
  const NarrowBand base = support::makeBall(2, 0.1);
  std::array<V3d, 4> corners = support::cap(0.5, 2);
  std::swap(corners[1], corners[3]);
  const Patch patch = mapping::makePatch(base, corners, 0.5, {.mirror = true}).patch;
  ASSERT_TRUE(patch.mirrored);
  const TriMesh moved = mapping::mapMesh(ballMesh(1, 0.2), patch, {.map = MeshMap::Prisms}).mesh;
  EXPECT_GT(levelset::signedVolume(moved), 0);
}

TEST(MeshShell, RefusesFoldsOrLeavesThemOut) {
  const TriMesh mesh = randomMesh(kUnitBox, 20);
  const Patch sound = patchAt(wavy, 6, 5, 3, 0.5);
  Patch folded = sound;
  std::swap(folded.layers[1].positions[7], folded.layers[1].positions[8]);
  const std::array<Patch, 2> patches = {folded, sound};
  EXPECT_THROW((void)mapping::mapMesh(mesh, patches, {.map = MeshMap::Prisms}),
               levelset::InvalidInput);
  const mapping::MeshTextureResult result =
      mapping::mapMesh(mesh, patches, {.map = MeshMap::Prisms, .skipFolds = true});
  EXPECT_EQ(result.skipped, 1u);
  EXPECT_EQ(result.mesh.positions,
            mapping::mapMesh(mesh, sound, {.map = MeshMap::Prisms}).mesh.positions);
  const mapping::MeshTextureResult allowed =
      mapping::mapMesh(mesh, folded, {.map = MeshMap::Prisms, .allowFolds = true});
  EXPECT_GT(allowed.distortion.folded, 0u);
  EXPECT_EQ(allowed.certificate.verdict(), mapping::FoldVerdict::Folds);
  EXPECT_THROW((void)mapping::mapMesh(mesh, sound, {.map = MeshMap::Prisms, .maxMemory = 10'000}),
               levelset::ResourceLimit);
}

TEST(MeshShell, SameBitsForAnyNumberOfThreads) {
  const TriMesh mesh = randomMesh(kUnitBox, 8000);
  const Patch patch = patchAt(wavy, 9, 7, 4, 0.5);
  const auto moved = [&] {
    return mapping::mapMesh(mesh, patch, {.map = MeshMap::Prisms}).mesh.positions;
  };
  EXPECT_EQ(support::onThreads(1, moved), support::onThreads(7, moved));
}

}  // namespace mesh_shell_test
