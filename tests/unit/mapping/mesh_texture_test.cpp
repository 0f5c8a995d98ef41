#include "mapping/textures/mesh_texture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/error.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/sample.h"
#include "mapping/textures/geometric_texture.h"
#include "tests/support/patches.h"

namespace mesh_texture_test {

using Imath::V3d;
using levelset::NarrowBand;
using levelset::TriMesh;
using mapping::Patch;
using support::cap;
using support::makeBall;

/// A torus about the z axis, as triangles.
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
  // Semi-implicit and implicit results of one model: within a voxel, both ways.
  const double radius = 2, voxel = 0.05;
  const NarrowBand base = makeBall(radius, voxel);
  const TriMesh ring = makeRing(1, 0.25, 200, 60);
  ASSERT_GT(levelset::signedVolume(ring), 0);
  const NarrowBand solid = levelset::meshToBand(ring, voxel).band;
  const Patch patch = mapping::makePatch(base, cap(0.6, radius), 0.6).patch;
  const mapping::MeshTextureResult moved = mapping::mapMesh(ring, patch, {.sink = voxel});
  EXPECT_EQ(moved.mesh.triangles, ring.triangles);
  EXPECT_GT(levelset::signedVolume(moved.mesh), 0);
  for (const mapping::TextureMap map : {mapping::TextureMap::Rbf, mapping::TextureMap::Shell}) {
    const NarrowBand warped = mapping::mapTexture(base, solid, patch,
                                                  {.merge = mapping::TextureMerge::Alone,
                                                   .map = map,
                                                   .sink = voxel,
                                                   .textureBox = levelset::bounds(ring),
                                                   .voxelSize = voxel})
                                  .band;
    const levelset::BandSampler sampler(warped);
    double worst = 0;
    for (const V3d& p : moved.mesh.positions)
      worst = std::max(worst, std::abs(sampler.value(p)) / voxel);
    EXPECT_LE(worst, 1) << static_cast<int>(map);
    const NarrowBand filled = levelset::meshToBand(moved.mesh, voxel).band;
    const levelset::BandSampler other(filled);
    worst = 0;
    for (const V3d& p : levelset::bandToMesh(warped).positions)
      worst = std::max(worst, std::abs(other.value(p)) / voxel);
    EXPECT_LE(worst, 1) << static_cast<int>(map);
  }
}

TEST(MeshTexture, StaysInThePatch) {
  // Trilinear positions never leave the hull of the particles about them.
  const double radius = 2, height = 0.5;
  const Patch patch = mapping::makePatch(makeBall(radius, 0.1), cap(0.5, radius), height).patch;
  const TriMesh mesh = mapping::mapMesh(makeRing(1, 0.3, 40, 20), patch).mesh;
  for (const V3d& p : mesh.positions) {
    EXPECT_LE(p.length(), radius + height + 1e-6);
    EXPECT_GE(p.length(), radius - 0.02);  // chords of the particles
  }
}

TEST(MeshTexture, FacesAsBeforeOnAMirroredPatch) {
  const NarrowBand base = makeBall(2, 0.1);
  std::array<V3d, 4> corners = cap(0.5, 2);
  std::swap(corners[1], corners[3]);
  const Patch patch = mapping::makePatch(base, corners, 0.5, {.mirror = true}).patch;
  ASSERT_TRUE(patch.mirrored);
  EXPECT_GT(levelset::signedVolume(mapping::mapMesh(makeRing(1, 0.3, 40, 20), patch).mesh), 0);
}

TEST(MeshTexture, RefusesWhatCannotBeMoved) {
  const Patch patch = mapping::makePatch(makeBall(2, 0.1), cap(0.5, 2), 0.5).patch;
  const TriMesh ring = makeRing(1, 0.3, 12, 8);
  EXPECT_THROW((void)mapping::mapMesh({}, patch), levelset::InvalidInput);
  EXPECT_THROW((void)mapping::mapMesh(ring, Patch{}), levelset::InvalidInput);
  EXPECT_THROW((void)mapping::mapMesh(ring, patch, {.sink = std::nan("")}), levelset::UsageError);
  TriMesh flat = ring;
  for (V3d& p : flat.positions) p.z = 0;
  EXPECT_THROW((void)mapping::mapMesh(flat, patch), levelset::InvalidInput);
  // A flat mesh has a place too, once its box is told.
  const Imath::Box3d box(V3d(-1.3, -1.3, 0), V3d(1.3, 1.3, 1));
  for (const V3d& p : mapping::mapMesh(flat, patch, {.textureBox = box}).mesh.positions)
    EXPECT_NEAR(p.length(), 2, 0.02);
  Patch folded = patch;
  for (V3d& p : folded.levels.back().positions) p *= 0.5;
  EXPECT_THROW((void)mapping::mapMesh(ring, folded), levelset::InvalidInput);
  EXPECT_GT(mapping::mapMesh(ring, folded, {.allowFolds = true}).distortion.folded, 0u);
  EXPECT_THROW((void)mapping::mapMesh(ring, patch, {.progress = [](double) { return false; }}),
               levelset::Cancelled);
}

}  // namespace mesh_texture_test
