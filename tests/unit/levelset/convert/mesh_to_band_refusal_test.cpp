#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/error.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/meshes.h"

namespace mesh_to_band_refusal_test {

using namespace levelset;
using namespace support;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

/// Expects that the conversion fails with this exit code and that the message contains `words`.
void expectRefused(const TriMesh& mesh, double voxel, ExitCode code, const std::string& words,
                   const MeshToBandOptions& options = {}) {
  try {
    (void)meshToBand(mesh, voxel, options);
    FAIL() << "accepted instead of: " << words;
  } catch (const Error& error) {
    EXPECT_EQ(error.exitCode(), code) << error.what();
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
  }
}

TEST(MeshToBandRefusal, NamesBadVoxelSizes) {
  const TriMesh box = boxMesh(V3d(0), V3d(1));
  for (const double voxel : {0.0, -0.1, kNan, kInf})
    expectRefused(box, voxel, ExitCode::Usage, "voxel size is");
  expectRefused(box, 0.1, ExitCode::Usage, "half width is", {.halfWidth = 0.5});
  expectRefused(box, 0.1, ExitCode::Usage, "half width is", {.halfWidth = kNan});
  expectRefused(box, 1e-9, ExitCode::Resource, "GB");
  expectRefused(box, 1e-12, ExitCode::Resource, "32-bit indices");
  expectRefused(box, 1e-3, ExitCode::Resource, "exceeds the limit", {.maxMemory = 1000000});
  expectRefused(box, 100, ExitCode::Input, "larger than the object");
}

TEST(MeshToBandRefusal, NamesBadElements) {
  expectRefused({}, 0.1, ExitCode::Input, "no triangles");
  TriMesh mesh = boxMesh(V3d(0), V3d(1));
  mesh.positions[5].y = kNan;
  expectRefused(mesh, 0.1, ExitCode::Input, "vertex 5");
  mesh.positions[5].y = kInf;
  expectRefused(mesh, 0.1, ExitCode::Input, "vertex 5");
  mesh.positions[5].y = 1e30;
  expectRefused(mesh, 0.1, ExitCode::Resource, "vertex 5");
  mesh = boxMesh(V3d(0), V3d(1));
  mesh.triangles[7][1] = 8;
  expectRefused(mesh, 0.1, ExitCode::Input, "triangle 7 refers to vertex 8");
  TriMesh point{{V3d(0), V3d(1), V3d(2)}, {{0, 0, 1}}};
  expectRefused(point, 0.1, ExitCode::Input, "degenerate");
}

TEST(MeshToBandRefusal, NamesCoordinatesTooCoarse) {
  TriMesh mesh = boxMesh(V3d(1e7), V3d(1e7 + 4));
  mesh.precision = CoordinatePrecision::Float;
  expectRefused(mesh, 0.02, ExitCode::Input, "single-precision");
  mesh.precision = CoordinatePrecision::Double;
  EXPECT_NO_THROW((void)meshToBand(mesh, 0.2));
}

TEST(MeshToBandRefusal, NamesOpenMeshes) {
  const TriMesh triangle{{V3d(0), V3d(1, 0, 0), V3d(0, 1, 0)}, {{0, 1, 2}}};
  for (const SignMode mode : {SignMode::Auto, SignMode::Winding})
    expectRefused(triangle, 0.1, ExitCode::Input, "encloses no volume", {.sign = mode});
  expectRefused(triangle, 0.1, ExitCode::Input, "3 edges have one face",
                {.sign = SignMode::Closed});

  const TriMesh bowl = sphereMesh(1, V3d(0), 8, 0.5);
  expectRefused(bowl, 0.1, ExitCode::Input, "use --sign winding", {.sign = SignMode::Closed});
  expectRefused(bowl, 0.1, ExitCode::Input, "--accept-sign");

  const TriMesh moebius = [] {
    TriMesh mesh = patchMesh(33, 5, false, false, [](double u, double v) {
      const double a = 2 * std::numbers::pi * u, w = v - 0.5;
      const double r = 1 + w * std::cos(a / 2);
      return V3d(r * std::cos(a), r * std::sin(a), w * std::sin(a / 2));
    });
    for (auto& t : mesh.triangles)  // the last row is the first row mirrored
      for (auto& v : t)
        if (v >= 32 * 5) v = 4 - (v - 32 * 5);
    return mesh;
  }();
  expectRefused(moebius, 0.1, ExitCode::Input, "not closed", {.sign = SignMode::Closed});
}

TEST(MeshToBandRefusal, GivesUnsignedDistancesOnRequest) {
  const TriMesh triangle{{V3d(0), V3d(1, 0, 0), V3d(0, 1, 0)}, {{0, 1, 2}}};
  for (const SignMode mode : {SignMode::Auto, SignMode::Winding}) {
    const auto result = meshToBand(triangle, 0.1, {.sign = mode, .acceptSign = true});
    EXPECT_EQ(result.certificate.ambiguousShare, 1);
    EXPECT_TRUE(result.band.zeroSetBounds().isEmpty());
    EXPECT_GT(result.band.activeVoxelCount(), 300);
    forEachActive(result.band, [&](const V3d& p, double phi) {
      EXPECT_NEAR(phi, unsignedDistance(triangle, p), support::rounding(0.2));
    });
  }
}

TEST(MeshToBandRefusal, NamesComponentsOfInconsistentOrientation) {
  TriMesh mesh = boxMesh(V3d(0), V3d(1));
  std::swap(mesh.triangles[3][0], mesh.triangles[3][1]);
  expectRefused(mesh, 0.1, ExitCode::Input, "--nested parity",
                {.sign = SignMode::Closed, .nesting = Nesting::Orientation});
  EXPECT_EQ(meshToBand(mesh, 0.1, {.sign = SignMode::Closed}).band.contentHash(),
            meshToBand(boxMesh(V3d(0), V3d(1)), 0.1).band.contentHash());
}

TEST(MeshToBandRefusal, NamesObjectsThinnerThanTheGrid) {
  expectRefused(boxMesh(V3d(0, 0, 0.31), V3d(2, 2, 0.34)), 0.1, ExitCode::Input,
                "thinner than a voxel");
}

}  // namespace mesh_to_band_refusal_test
