#include "mapping/textures/mesh_texture.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/meshing/band_to_mesh.h"
#include "mapping/placement/make_patch.h"
#include "mapping/textures/geometric_texture.h"
#include "tests/support/measured.h"
#include "tests/support/patches.h"

namespace mesh_texture_test {

using Imath::V3d;
using levelset::NarrowBand;
using levelset::TriMesh;
using mapping::Patch;
using support::cap;
using support::makeBall;

/// Torus around the z axis, as triangles.
TriMesh makeRing(double radius, double tube, std::uint32_t around, std::uint32_t across) {
  TriMesh mesh;
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t j = 0; j < across; ++j) {
      const double a = 2 * M_PI * i / around, b = 2 * M_PI * j / across;
      const double r = radius + tube * std::cos(b);
      mesh.positions.emplace_back(r * std::cos(a), r * std::sin(a), tube * std::sin(b));
      const auto at = [&](std::uint32_t k, std::uint32_t l) {
        return (k % around) * across + l % across;
      };
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

TEST(MeshTexture, AgreesWithTheImplicitMap) {
  // Semi-implicit and implicit results of one model agree within a voxel, in both directions.
  const double radius = 2, voxel = 0.05;
  const NarrowBand base = makeBall(radius, voxel);
  const TriMesh ring = makeRing(1, 0.25, 200, 60);
  ASSERT_GT(levelset::signedVolume(ring), 0);
  const NarrowBand solid = levelset::meshToBand(ring, voxel).band;
  const Patch patch = mapping::makePatch(base, cap(0.6, radius), 0.6).patch;
  for (const double sink : {voxel, 0.3, 0.55})
    for (const mapping::TextureMap map : {mapping::TextureMap::Rbf, mapping::TextureMap::Prism}) {
      const mapping::MeshTextureResult moved = mapping::mapMesh(ring, patch, {.embedDepth = sink});
      EXPECT_EQ(moved.mesh.triangles, ring.triangles);
      EXPECT_GT(levelset::signedVolume(moved.mesh), 0);
      const NarrowBand warped = mapping::mapTexture(base, solid, patch,
                                                    {.merge = mapping::TextureMerge::Alone,
                                                     .map = map,
                                                     .embedDepth = sink,
                                                     .textureBox = levelset::bounds(ring),
                                                     .voxelSize = voxel})
                                    .band;
      const levelset::BandSampler sampler(warped);
      double worst = 0;
      for (const V3d& p : moved.mesh.positions)
        worst = std::max(worst, std::abs(sampler.value(p)) / voxel);
      EXPECT_LE(worst, support::measured(0.232)) << static_cast<int>(map) << " sunk by " << sink;
      const NarrowBand filled = levelset::meshToBand(moved.mesh, voxel).band;
      const levelset::BandSampler other(filled);
      worst = 0;
      for (const V3d& p : levelset::bandToMesh(warped).positions)
        worst = std::max(worst, std::abs(other.value(p)) / voxel);
      EXPECT_LE(worst, support::measured(0.21)) << static_cast<int>(map);
    }
}

TEST(MeshTexture, StaysInThePatch) {
  // Trilinear positions never leave the convex hull of the surrounding particles.
  const double radius = 2, height = 0.5;
  const Patch patch = mapping::makePatch(makeBall(radius, 0.1), cap(0.5, radius), height).patch;
  const TriMesh mesh = mapping::mapMesh(makeRing(1, 0.3, 40, 20), patch).mesh;
  for (const V3d& p : mesh.positions) {
    EXPECT_LE(p.length(), radius + height + 1e-6);
    EXPECT_GE(p.length(), radius - 0.02);  // chords between the particles
  }
}

TEST(MeshTexture, KeepsItsOrientationOnAMirroredPatch) {
  const NarrowBand base = makeBall(2, 0.1);
  std::array<V3d, 4> corners = cap(0.5, 2);
  std::swap(corners[1], corners[3]);
  const Patch patch = mapping::makePatch(base, corners, 0.5, {.mirror = true}).patch;
  ASSERT_TRUE(patch.mirrored);
  EXPECT_GT(levelset::signedVolume(mapping::mapMesh(makeRing(1, 0.3, 40, 20), patch).mesh), 0);
}

TEST(MeshTexture, LeavesOutPatchesThatFold) {
  const NarrowBand base = makeBall(2, 0.1);
  const TriMesh ring = makeRing(1, 0.25, 20, 8);
  const Patch sound = mapping::makePatch(base, cap(0.4, 2), 0.5, {.layers = 3}).patch;
  Patch folded = sound;
  std::swap(folded.layers[1].positions[7], folded.layers[1].positions[8]);
  const std::array<Patch, 3> patches = {folded, sound, folded};
  EXPECT_THROW((void)mapping::mapMesh(ring, patches), levelset::InvalidInput);
  const mapping::MeshTextureResult result = mapping::mapMesh(ring, patches, {.skipFolds = true});
  EXPECT_EQ(result.skipped, 2u);
  EXPECT_EQ(result.mesh.positions, mapping::mapMesh(ring, sound).mesh.positions);
  EXPECT_THROW((void)mapping::mapMesh(ring, std::span(patches).first(1), {.skipFolds = true}),
               levelset::InvalidInput);
}

TEST(MeshTexture, RefusesInvalidMeshes) {
  const Patch patch = mapping::makePatch(makeBall(2, 0.1), cap(0.5, 2), 0.5).patch;
  const TriMesh ring = makeRing(1, 0.3, 12, 8);
  EXPECT_THROW((void)mapping::mapMesh({}, patch), levelset::InvalidInput);
  EXPECT_THROW((void)mapping::mapMesh(ring, Patch{}), levelset::InvalidInput);
  EXPECT_THROW((void)mapping::mapMesh(ring, patch, {.embedDepth = std::nan("")}),
               levelset::UsageError);
  TriMesh flat = ring;
  for (V3d& p : flat.positions) p.z = 0;
  EXPECT_THROW((void)mapping::mapMesh(flat, patch), levelset::InvalidInput);
  // A flat mesh can be mapped too, with an explicit box.
  const Imath::Box3d box(V3d(-1.3, -1.3, 0), V3d(1.3, 1.3, 1));
  for (const V3d& p : mapping::mapMesh(flat, patch, {.textureBox = box}).mesh.positions)
    EXPECT_NEAR(p.length(), 2, support::measured(0.00304));
  Patch folded = patch;
  for (V3d& p : folded.layers.back().positions) p *= 0.5;
  EXPECT_THROW((void)mapping::mapMesh(ring, folded), levelset::InvalidInput);
  EXPECT_GT(mapping::mapMesh(ring, folded, {.allowFolds = true}).distortion.folded, 0u);
  EXPECT_THROW((void)mapping::mapMesh(ring, patch, {.progress = [](double) { return false; }}),
               levelset::Cancelled);
}

// === Vertex attributes

/// Particles of a smooth map, `cells` along each side, in three layers.
Patch patchOf(const std::function<V3d(const V3d&)>& place, std::size_t cells, double height) {
  Patch patch;
  patch.height = height;
  for (std::size_t k = 0; k < 3; ++k) {
    mapping::ParticleLayer layer;
    layer.columns = layer.rows = cells + 1;
    layer.w = static_cast<double>(k) / 2;
    for (std::size_t j = 0; j <= cells; ++j)
      for (std::size_t i = 0; i <= cells; ++i)
        layer.positions.push_back(
            place({static_cast<double>(i) / static_cast<double>(cells),
                   static_cast<double>(j) / static_cast<double>(cells), layer.w}));
    patch.layers.push_back(std::move(layer));
  }
  return patch;
}

/// Flat sheet in the unit cube at w = `height`. It has normals upwards, its positions as texture
/// coordinates, and colours.
TriMesh sheet(std::uint32_t cells, double height) {
  TriMesh mesh;
  for (std::uint32_t j = 0; j <= cells; ++j)
    for (std::uint32_t i = 0; i <= cells; ++i) {
      const double u = static_cast<double>(i) / cells, v = static_cast<double>(j) / cells;
      mesh.positions.emplace_back(u, v, height);
      mesh.attributes.normals.emplace_back(0, 0, 3);
      mesh.attributes.uvs.emplace_back(u, v);
      mesh.attributes.colors.emplace_back(0.2f, static_cast<float>(u), 0.f, 1.f);
      if (i == cells || j == cells) continue;
      const std::uint32_t a = j * (cells + 1) + i, b = a + 1, c = a + cells + 1;
      mesh.triangles.push_back({a, b, c + 1});
      mesh.triangles.push_back({a, c + 1, c});
    }
  return mesh;
}

const Imath::Box3d kUnitBox(V3d(0), V3d(1));

/// Largest angle between the sheet's normals and `truth` at their positions, radians.
double worstAngle(const Patch& patch, const std::function<V3d(const V3d&)>& truth) {
  // 29 and the number of cells are coprime, so that vertices lie anywhere in cells and on their
  // borders.
  const TriMesh mesh = mapping::mapMesh(sheet(29, 0.7), patch, {.textureBox = kUnitBox}).mesh;
  double worst = 0;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const V3d& normal = mesh.attributes.normals[v];
    EXPECT_NEAR(normal.length(), 1, support::doubleRounding(1.5));
    worst = std::max(worst, (normal - truth(mesh.positions[v]).normalized()).length());
  }
  return worst;
}

TEST(MeshTextureAttributes, NormalsOfAStraightMapAreExact) {
  const Patch patch =
      patchOf([](const V3d& p) { return V3d(2 * p.x + p.z, 3 * p.y, p.z / 2); }, 5, 0.5);
  TriMesh mesh = sheet(7, 0.25);
  const V3d tilted(0.3, -2, 1);
  for (V3d& normal : mesh.attributes.normals) normal = tilted;
  const mapping::MeshTextureResult moved = mapping::mapMesh(mesh, patch, {.textureBox = kUnitBox});
  // Solved by hand: n' · (2, 0, 0) = 0.3, n' · (0, 3, 0) = −2, n' · (1, 0, 1/2) = 1, up to length.
  const V3d truth = V3d(0.15, -2.0 / 3, 2 * (1 - 0.15)).normalized();
  for (const V3d& normal : moved.mesh.attributes.normals)
    EXPECT_LT((normal - truth).length(), support::doubleRounding(3));
  EXPECT_EQ(moved.mesh.attributes.uvs, mesh.attributes.uvs);
  EXPECT_EQ(moved.mesh.attributes.colors, mesh.attributes.colors);
  EXPECT_TRUE(moved.notes.empty());
}

TEST(MeshTextureAttributes, NormalsOfASheetAreRadial) {
  // Cells are straight, so normals are off by up to half of the angle that a cell spans. On the
  // ball this is along its diagonal, with a small addition from shear. It is of first order in the
  // spacing.
  const double arc = 1.2;
  const auto cylinder = [&](const V3d& p) {
    const double a = arc * (p.x - 0.5), r = 2 + 0.5 * p.z;
    return V3d(r * std::sin(a), 3 * p.y, r * std::cos(a));
  };
  const auto ball = [&](const V3d& p) {
    return V3d(std::tan(arc * (p.x - 0.5)), std::tan(arc * (p.y - 0.5)), 1).normalized() *
           (2 + 0.5 * p.z);
  };
  double before = 0, beforeBall = 0;
  for (const std::size_t cells : {8, 16, 32}) {
    const double cell = arc / static_cast<double>(cells);
    const double off =
        worstAngle(patchOf(cylinder, cells, 0.5), [](const V3d& p) { return V3d(p.x, 0, p.z); });
    const double offBall = worstAngle(patchOf(ball, cells, 0.5), [](const V3d& p) { return p; });
    EXPECT_LE(off, support::measured(0.5, 0.51) * cell) << cells;
    EXPECT_LE(offBall, support::measured(0.782, 0.8) * cell) << cells;
    if (before > 0) {
      EXPECT_NEAR(before / off, 2, support::measured(3.52e-4)) << cells;
      EXPECT_NEAR(beforeBall / offBall, 2, support::measured(0.0274)) << cells;
    }
    before = off;
    beforeBall = offBall;
  }
}

TEST(MeshTextureAttributes, NormalsStayOnTheSideOfTheirTriangles) {
  TriMesh ring = makeRing(1, 0.3, 40, 20);
  for (std::uint32_t i = 0; i < 40; ++i)
    for (std::uint32_t j = 0; j < 20; ++j) {
      const double a = 2 * M_PI * i / 40, b = 2 * M_PI * j / 20;
      ring.attributes.normals.emplace_back(std::cos(b) * std::cos(a), std::cos(b) * std::sin(a),
                                           std::sin(b));
    }
  const NarrowBand base = makeBall(2, 0.1);
  std::array<V3d, 4> corners = cap(0.5, 2);
  for (const bool mirrored : {false, true}) {
    if (mirrored) std::swap(corners[1], corners[3]);
    const Patch patch = mapping::makePatch(base, corners, 0.5, {.mirror = mirrored}).patch;
    ASSERT_EQ(patch.mirrored, mirrored);
    const TriMesh mesh = mapping::mapMesh(ring, patch).mesh;
    std::vector<V3d> across(mesh.positions.size(), V3d(0));
    for (const auto& t : mesh.triangles) {
      const V3d area = (mesh.positions[t[1]] - mesh.positions[t[0]])
                           .cross(mesh.positions[t[2]] - mesh.positions[t[0]]);
      for (const std::uint32_t v : t) across[v] += area;
    }
    // Facets of 18 degrees on a stretched tube.
    for (std::size_t v = 0; v < across.size(); ++v)
      ASSERT_GT(across[v].normalized().dot(mesh.attributes.normals[v]), 0.97) << v << mirrored;
  }
}

TEST(MeshTextureAttributes, ManyPatchesAppendTheirAttributes) {
  const Patch one = patchOf([](const V3d& p) { return p; }, 4, 1);
  const Patch other = patchOf([](const V3d& p) { return V3d(p.x + 3, p.z, -p.y); }, 4, 1);
  const TriMesh mesh = sheet(3, 0.5);
  const std::array<Patch, 2> patches = {one, other};
  const TriMesh all = mapping::mapMesh(mesh, patches, {.textureBox = kUnitBox}).mesh;
  const std::size_t count = mesh.positions.size();
  ASSERT_EQ(all.attributes.normals.size(), 2 * count);
  ASSERT_EQ(all.attributes.uvs.size(), 2 * count);
  for (std::size_t v = 0; v < count; ++v) {
    EXPECT_LT((all.attributes.normals[v] - V3d(0, 0, 1)).length(), support::doubleRounding(4));
    EXPECT_LT((all.attributes.normals[v + count] - V3d(0, 1, 0)).length(),
              support::doubleRounding(1));
    EXPECT_EQ(all.attributes.colors[v + count], mesh.attributes.colors[v]);
  }
}

TEST(MeshTextureAttributes, NormalsOfLengthZeroStayZeroAndNaNIsRefused) {
  const Patch patch = patchOf([](const V3d& p) { return p; }, 4, 1);
  TriMesh mesh = sheet(3, 0.5);
  mesh.attributes.normals[5] = V3d(0);
  const mapping::MeshTextureResult moved = mapping::mapMesh(mesh, patch, {.textureBox = kUnitBox});
  EXPECT_EQ(moved.mesh.attributes.normals[5], V3d(0));
  ASSERT_EQ(moved.notes.size(), 1u);
  EXPECT_NE(moved.notes[0].find("1 of 16 normals"), std::string::npos);
  const std::vector<Patch> many(7, patch);
  const mapping::MeshTextureResult all = mapping::mapMesh(mesh, many, {.textureBox = kUnitBox});
  EXPECT_EQ(all.lostNormals, 7u);
  ASSERT_EQ(all.notes.size(), 1u);  // once, not for each patch
  EXPECT_NE(all.notes[0].find("7 of 112 normals"), std::string::npos);
  mesh.attributes.normals[5].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)mapping::mapMesh(mesh, patch, {.textureBox = kUnitBox}),
               levelset::InvalidInput);
  mesh.attributes.normals.resize(5);
  EXPECT_THROW((void)mapping::mapMesh(mesh, patch, {.textureBox = kUnitBox}),
               levelset::InvalidInput);
}

TEST(MeshTextureAttributes, PositionsDoNotDependOnAttributes) {
  const Patch patch = mapping::makePatch(makeBall(2, 0.1), cap(0.5, 2), 0.5).patch;
  TriMesh mesh = sheet(37, 0.37);
  const TriMesh with = mapping::mapMesh(mesh, patch, {.textureBox = kUnitBox}).mesh;
  mesh.attributes = {};
  EXPECT_EQ(mapping::mapMesh(mesh, patch, {.textureBox = kUnitBox}).mesh.positions, with.positions);
}

}  // namespace mesh_texture_test
