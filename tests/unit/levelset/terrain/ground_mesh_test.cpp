#include "levelset/terrain/ground_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/inspect/compare.h"
#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"
#include "levelset/terrain/measure_ground.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/terrains.h"

namespace ground_mesh_test {

using Imath::Box3d;
using Imath::V3d;
using levelset::BandSampler;
using levelset::HeightField;
using levelset::InvalidInput;
using levelset::TriMesh;
using support::doubleRounding;
using support::refusal;
using support::terrainOf;

TEST(GroundMesh, HasTheTrianglesOfTheGround) {
  const HeightField field = support::randomTerrain(30, 20, 0, 1);
  const TriMesh mesh = levelset::groundMesh(field);
  EXPECT_EQ(mesh.positions.size(), 600u);
  EXPECT_EQ(mesh.triangles.size(), 2u * 29 * 19);
  const double area = levelset::measureGround(field).area;
  EXPECT_NEAR(levelset::surfaceArea(mesh), area, area * doubleRounding(16));
  const levelset::Manifoldness manifold = levelset::manifoldness(mesh);
  EXPECT_EQ(manifold.boundaryEdges, 2u * (29 + 19));
  EXPECT_EQ(manifold.nonManifoldEdges + manifold.misorientedEdges + manifold.nonManifoldVertices,
            0u);
  for (const auto& [a, b, c] : mesh.triangles)
    EXPECT_GT(
        (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]).z, 0);
}

/// Any holes: the solid stays a closed manifold, with the volume above its base.
TEST(GroundSolidMesh, IsClosedWithAnyHoles) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const HeightField field = support::randomTerrain(16, 12, 0.03 * seed, seed);
    const TriMesh mesh = levelset::groundSolidMesh(field, -0.5, {.allowMissing = true});
    EXPECT_TRUE(levelset::manifoldness(mesh).isClosedManifold()) << seed;
    const double volume = levelset::measureGround(field, {.height = -0.5}).volumeAbove;
    EXPECT_NEAR(levelset::signedVolume(mesh), volume, volume * doubleRounding(1)) << seed;
    const levelset::Manifoldness open =
        levelset::manifoldness(levelset::groundMesh(field, {.allowMissing = true}));
    EXPECT_EQ(open.nonManifoldEdges + open.misorientedEdges + open.nonManifoldVertices, 0u) << seed;
  }
}

TEST(GroundSolidMesh, RefusesWhatHasNoGround) {
  HeightField field = support::randomTerrain(5, 5, 0, 1);
  const auto refused = [&](double base, const levelset::GroundMeshOptions& options = {}) {
    return refusal<InvalidInput>(
        [&] { static_cast<void>(levelset::groundSolidMesh(field, base, options)); });
  };
  EXPECT_SAYS(refused(0.9), "give a lower base");
  EXPECT_SAYS(refused(field.bounds().min.z), "give a lower base");
  EXPECT_SAYS(refused(NAN), "give a lower base");
  EXPECT_SAYS(refusal<levelset::ResourceLimit>([&] {
                static_cast<void>(levelset::groundSolidMesh(field, -1, {.maxMemory = 1000}));
              }),
              "");
  field.heights[7] = levelset::kMissingHeight;
  EXPECT_SAYS(refused(-1), "1 of 25 samples have no data");
  for (std::size_t n = 0; n < 25; n += 2) field.heights[n] = levelset::kMissingHeight;
  EXPECT_SAYS(refused(-1, {.allowMissing = true}), "no three neighbouring samples");
  field = support::randomTerrain(5, 1, 0, 1);
  EXPECT_SAYS(refused(-1), "5x1 samples");
  field = support::randomTerrain(5, 5, 0, 1);
  field.isGeographic = true;
  EXPECT_SAYS(refused(-1), "degrees");
}

TEST(Solidify, MakesABoxOfLevelGround) {
  const HeightField field = terrainOf(5, 4, {1, 1}, [](double, double) { return 1; });
  const levelset::MeshToBandResult result = levelset::solidify(field, -1, 0.1);
  EXPECT_TRUE(result.certificate.closed);
  EXPECT_EQ(result.certificate.method, levelset::SignMode::Closed);
  EXPECT_EQ(result.certificate.boundaryEdges + result.certificate.nonManifoldEdges, 0u);
  const levelset::NarrowBand box = levelset::makeBox(V3d(4, 3, 2), V3d(0), 0.1);
  const BandSampler one(result.band), other(box);
  double most = 0;
  for (double x = -2.2; x < 2.25; x += 0.1)
    for (double y = -1.7; y < 1.75; y += 0.1)
      for (double z = -1.2; z < 1.25; z += 0.1)
        most = std::max(most, std::abs(one.value({x, y, z}) - other.value({x, y, z})));
  EXPECT_LT(most, support::rounding(1));
}

TEST(LoweredEdges, ChangesTheBorderOnly) {
  const HeightField field = support::randomTerrain(9, 7, 0.1, 4);
  const HeightField lowered = levelset::loweredEdges(field, 0.5);
  for (int row = 0; row < 7; ++row)
    for (int column = 0; column < 9; ++column) {
      const bool isBorder = column == 0 || column == 8 || row == 0 || row == 6;
      ASSERT_EQ(lowered.isMissing(column, row), field.isMissing(column, row));
      if (field.isMissing(column, row)) continue;
      EXPECT_EQ(
          lowered.at(column, row),
          static_cast<float>(static_cast<double>(field.at(column, row)) - (isBorder ? 0.5 : 0)));
    }
  EXPECT_EQ(levelset::loweredEdges(field, 0).missingCount(), field.missingCount());
  const HeightField one = terrainOf(1, 1, {1, 1}, [](double, double) { return 3; });
  EXPECT_EQ(levelset::loweredEdges(one, 1).at(0, 0), 2);
  EXPECT_THROW((void)levelset::loweredEdges(field, -1), levelset::UsageError);
  EXPECT_THROW((void)levelset::loweredEdges(field, HUGE_VAL), levelset::UsageError);
}

/// The volume of the solid converges to that of the prisms below its triangles. A level set rounds
/// each edge by about half a voxel².
TEST(Solidify, HasTheVolumeOfThePrisms) {
  const HeightField field = terrainOf(21, 21, {0.2, 0.2}, [](double x, double y) {
    return 0.4 * std::sin(2 * x) * std::cos(1.5 * y);
  });
  const double volume = levelset::measureGround(field, {.height = -1}).volumeAbove;
  double errors[2];
  for (int n = 0; n < 2; ++n)
    errors[n] = std::abs(
        levelset::measure(levelset::solidify(field, -1, 0.1 / (1 << n)).band).volume - volume);
  EXPECT_LT(errors[1], support::measured(0.043));
  EXPECT_GT(std::log2(errors[0] / errors[1]), support::measuredOrder(2));
}

/// With holes that meet in single samples, points are inside where the ground is above them.
TEST(Solidify, KnowsInsideAndOutsideBesideHoles) {
  const HeightField field = support::randomTerrain(13, 11, 0.25, 2);
  const levelset::MeshToBandResult result =
      levelset::solidify(field, -1, 0.1, {.allowMissing = true});
  EXPECT_EQ(result.certificate.boundaryEdges, 0u);
  EXPECT_GT(result.certificate.nonManifoldEdges, 0u);  // walls that meet in an edge
  EXPECT_EQ(result.certificate.ambiguousShare, 0);
  const BandSampler sampler(result.band);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0, 1);
  std::size_t inside = 0, outside = 0;
  for (int n = 0; n < 20'000; ++n) {
    const double x = 12 * unit(random), y = 10 * unit(random), z = -1.2 + 2.4 * unit(random);
    const V3d p(x + field.origin.x, y + field.origin.y, z);
    const double value = sampler.value(p);
    if (std::abs(value) < 0.1) continue;
    const int column = static_cast<int>(x), row = static_cast<int>(y);
    const double u = x - column, v = y - row;
    const auto at = [&](int c, int r) {
      return static_cast<double>(field.at(column + c, row + r));
    };
    const double ground = u >= v ? at(0, 0) + (at(1, 0) - at(0, 0)) * u + (at(1, 1) - at(1, 0)) * v
                                 : at(0, 0) + (at(0, 1) - at(0, 0)) * v + (at(1, 1) - at(0, 1)) * u;
    const bool isInside = z > -1 && z < ground;  // no comparison with NaN is true
    EXPECT_EQ(value < 0, isInside) << p.x << " " << p.y << " " << p.z;
    ++(isInside ? inside : outside);
  }
  EXPECT_GT(inside, 3000u);
  EXPECT_GT(outside, 3000u);
}

TEST(GroundBand, IsNegativeBelowTheGround) {
  const HeightField field =
      terrainOf(21, 21, {1, 1}, [](double x, double y) { return 0.5 * x - 0.25 * y; });
  const levelset::SurfaceBandResult result = levelset::groundBand(field, 0.5);
  EXPECT_TRUE(result.band.isOpenSurface());
  EXPECT_EQ(result.borderEdges, 80u);
  const V3d normal = V3d(-0.5, 0.25, 1).normalized();
  const BandSampler sampler(result.band);
  double most = 0;
  for (double x = -6; x <= 6; x += 0.75)
    for (double y = -6; y <= 6; y += 0.75)
      for (double along = -1.5; along <= 1.5; along += 0.25) {
        const V3d p = V3d(x, y, 0.5 * x - 0.25 * y) + along * normal;
        most = std::max(most, std::abs(sampler.value(p) - along));
      }
  EXPECT_LT(most, support::measured(3e-8));
}

/// The band in a box has the bits of the complete band there.
TEST(GroundBand, InABoxEqualsTheCompleteBand) {
  const HeightField field = terrainOf(
      81, 81, {0.5, 0.5}, [](double x, double y) { return std::sin(x) * std::cos(0.7 * y); });
  const Box3d box(V3d(-3, -2, -4), V3d(4, 5, 4));
  const levelset::NarrowBand whole = levelset::groundBand(field, 0.2).band,
                             part = levelset::groundBand(field, 0.2, {.box = box}).band;
  EXPECT_TRUE(part.isOpenSurface());
  EXPECT_LT(part.activeVoxelCount(), whole.activeVoxelCount() / 4);
  const BandSampler one(whole), other(part);
  std::size_t inside = 0;
  for (double x = -3; x <= 4; x += 0.2)
    for (double y = -2; y <= 5; y += 0.2)
      for (double z = -1.6; z <= 1.6; z += 0.2) {
        EXPECT_EQ(one.value({x, y, z}), other.value({x, y, z}));
        inside += one.isInBand({x, y, z});
      }
  EXPECT_GT(inside, 5000u);
}

TEST(GroundBand, RefusesBoxesWithoutGround) {
  HeightField field = terrainOf(21, 21, {1, 1}, [](double, double) { return 0; });
  const auto refused = [&](const Box3d& box) {
    return refusal<InvalidInput>(
        [&] { static_cast<void>(levelset::groundBand(field, 0.5, {.box = box})); });
  };
  EXPECT_SAYS(refused(Box3d(V3d(100, 0, -1), V3d(110, 1, 1))), "has no sample of the terrain");
  EXPECT_SAYS(refused(Box3d(V3d(0, 0, 50), V3d(1, 1, 51))), "no ground within the half width");
  EXPECT_SAYS(refusal<levelset::UsageError>(
                  [&] { static_cast<void>(levelset::groundBand(field, 0.5, {.box = Box3d()})); }),
              "empty");
  field.heights[field.index(10, 10)] = levelset::kMissingHeight;
  EXPECT_SAYS(refused(Box3d(V3d(0, 0, -1), V3d(1, 1, 1))), "have no data");
  // Away from the hole, the box has all its samples.
  EXPECT_NO_THROW(static_cast<void>(
      levelset::groundBand(field, 0.1, {.box = Box3d(V3d(5, 5, -1), V3d(6, 6, 1))})));
  EXPECT_NO_THROW(static_cast<void>(levelset::groundBand(
      field, 0.5, {.box = Box3d(V3d(0, 0, -1), V3d(1, 1, 1)), .allowMissing = true})));
}

}  // namespace ground_mesh_test
