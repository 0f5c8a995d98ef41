// Meshes and bands in any unit of length, and coordinates coarser than the grid.

#include <gtest/gtest.h>

#include <cmath>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/resample.h"
#include "levelset/transform/transform.h"
#include "levelset/vdb.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/meshes.h"

namespace mesh_to_band_scale_test {

using namespace levelset;
using namespace support;

constexpr double kUnits[] = {1e-12, 1e-6, 1.4e-5, 1, 1e6, 1e12};

TEST(MeshToBandScale, KeepsTheTreeInAnyUnitOfLength) {
  const TriMesh torus = torusMesh(1, 0.4, 24, 12, V3d(0.013, -0.021, 0.007));
  const double h = 0.0625;
  const NarrowBand plain = meshToBand(torus, h).band;
  for (const double unit : kUnits) {
    const TriMesh mesh = transformed(torus, [&](const V3d& p) { return p * unit; });
    const auto result = meshToBand(mesh, h * unit);
    EXPECT_EQ(result.certificate.method, SignMode::Closed) << unit;
    EXPECT_EQ(result.certificate.selfIntersections, 0) << unit;
    ASSERT_EQ(result.band.activeVoxelCount(), plain.activeVoxelCount()) << unit;
    EXPECT_NEAR(result.band.voxelSize(), h * unit, support::doubleRounding(4) * unit);
    const auto& tree = vdb(plain).tree();
    double worst = 0;
    for (auto it = vdb(result.band).cbeginValueOn(); it; ++it)
      worst = std::max(worst, std::abs(static_cast<double>(*it) / unit -
                                       static_cast<double>(tree.getValue(it.getCoord()))));
    EXPECT_LT(worst, support::rounding(4) * h) << unit;
  }
}

TEST(MeshToBandScale, CopiesWritesAndCombinesBandsInAnyUnit) {
  const TemporaryFolder folder;
  for (const double unit : kUnits) {
    const double h = 0.1 * unit;
    const NarrowBand ball = makeSphere(unit, Imath::V3d(0), h);
    EXPECT_EQ(ball.indexToWorld(), Imath::M44d().setScale(h)) << unit;
    NarrowBand copy = ball;
    (void)editVdb(copy);
    EXPECT_NE(&vdb(copy), &vdb(ball));
    EXPECT_EQ(copy.contentHash(), ball.contentHash()) << unit;
    writeBand(folder / "ball.vdb", ball);
    EXPECT_EQ(readBand(folder / "ball.vdb").contentHash(), ball.contentHash()) << unit;
    EXPECT_EQ(unite(ball, ball).activeVoxelCount(), ball.activeVoxelCount()) << unit;
    // Half the voxel size is another grid, even if both sizes are below OpenVDB's tolerance.
    EXPECT_FALSE(shareGrid(ball, makeSphere(unit, Imath::V3d(0), h / 2))) << unit;
    const NarrowBand finer = resample(ball, h / 2);
    EXPECT_NEAR(finer.zeroSetBounds().max.x, unit, support::doubleRounding(15) * h) << unit;
    const NarrowBand larger = transform(ball, Imath::M44d().setScale(2.0));
    EXPECT_NEAR(larger.zeroSetBounds().max.x, 2 * unit, support::rounding(1) * h) << unit;
  }
}

TEST(MeshToBandScale, RefusesValuesBeyondFloatsOrOpenVdb) {
  const TemporaryFolder folder;
  const NarrowBand ball = makeSphere(1e-6, Imath::V3d(0), 1e-7);
  const std::string sentence = refusal<ResourceLimit>(
      [&] { (void)transform(ball, Imath::M44d().setTranslation(V3d(1e-6))); });
  EXPECT_NE(sentence.find("too small for a rotated or translated grid"), std::string::npos);
  EXPECT_NE(refusal<InvalidInput>([&] { writeBand(folder / "ball.nvdb", ball); }).find("NanoVDB"),
            std::string::npos);
  EXPECT_EQ(folder.fileCount(), 0u);
  const TriMesh box = boxMesh(V3d(-1), V3d(1));
  const auto scaled = [&](double s) {
    return transformed(box, [&](const V3d& p) { return p * s; });
  };
  EXPECT_NE(
      refusal<InvalidInput>([&] { (void)meshToBand(scaled(1e-38), 1e-39); }).find("too small"),
      std::string::npos);
  EXPECT_NE(refusal<InvalidInput>([&] { (void)meshToBand(scaled(1e39), 2e38); }).find("too large"),
            std::string::npos);
  // Denormal coordinates must not cause a division by zero.
  EXPECT_THROW((void)meshToBand(scaled(5e-324), 5e-324), InvalidInput);
  TriMesh nearly = box;
  for (V3d& p : nearly.positions)
    if (p.x < 0) p.x = -4.9e-324;
  EXPECT_EQ(meshToBand(nearly, 0.2).certificate.method, SignMode::Closed);
}

// === Coordinates coarser than voxels

TriMesh floatBoxFarAway() {
  TriMesh mesh = boxMesh(V3d(1e7), V3d(1e7 + 4));
  mesh.precision = CoordinatePrecision::Float;
  return mesh;
}

TEST(MeshToBandScale, KeepsTheSpacingOfCoordinates) {
  const TriMesh home = transform(floatBoxFarAway(), Imath::M44d().setTranslation(V3d(-1e7)));
  EXPECT_EQ(home.spacing, 1);  // spacing of floats from 2²³ to 2²⁴
  const std::string sentence = refusal<InvalidInput>([&] { (void)meshToBand(home, 0.02); });
  EXPECT_NE(sentence.find("before the mesh was moved, its representable coordinates were 1 apart"),
            std::string::npos);
  // Scaling down also scales the uncertainty.
  const TriMesh small = transform(home, Imath::M44d().setScale(0.01));
  EXPECT_NEAR(small.spacing, 0.01, support::doubleRounding(4));
  EXPECT_THROW((void)meshToBand(small, 0.005), InvalidInput);
  // Coordinates that were fine when read remain fine.
  TriMesh near = boxMesh(V3d(0), V3d(4));
  near.precision = CoordinatePrecision::Float;
  const TriMesh moved = transform(near, Imath::M44d().setTranslation(V3d(1e7)));
  EXPECT_LT(moved.spacing, support::rounding(6));
  EXPECT_NO_THROW((void)meshToBand(moved, 0.2));
}

TEST(MeshToBandScale, WritesMovedMeshesWithoutRounding) {
  TriMesh mesh = boxMesh(V3d(0), V3d(0.25));
  mesh.precision = CoordinatePrecision::Float;
  const TriMesh moved = transform(mesh, Imath::M44d().setTranslation(V3d(1e7)));
  const TemporaryFolder folder;
  writeMesh(folder / "a.ply", moved);
  const TriMesh again = readMesh(folder / "a.ply");
  EXPECT_EQ(again.precision, CoordinatePrecision::Double);
  EXPECT_EQ(again.positions, moved.positions);
  EXPECT_EQ(again.positions[7], V3d(1e7 + 0.25));
}

}  // namespace mesh_to_band_scale_test
