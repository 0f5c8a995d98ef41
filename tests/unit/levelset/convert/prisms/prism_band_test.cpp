#include <gtest/gtest.h>

#include <filesystem>

#include "levelset/error.h"
#include "levelset/mesh_files/mesh_file.h"
#include "tests/support/mesh_bands.h"
#include "tests/support/sigg_meshes.h"
#include "tests/support/threads.h"

namespace prism_band_test {

using namespace levelset;
using namespace support;

MeshToBandOptions byPrisms(double halfWidth, SignMode sign = SignMode::Closed) {
  return {
      .halfWidth = halfWidth, .sign = sign, .acceptSign = true, .method = DistanceMethod::Prisms};
}

/// Expects the same active voxels and bits. At the end of the band, rounding may decide whether a
/// voxel is active, since two triangles at a common edge give distances that differ by rounding.
void expectSame(const NarrowBand& one, const NarrowBand& other, const char* name) {
  const openvdb::FloatGrid &a = vdb(one), &b = vdb(other);
  const float background = a.background();
  const auto end = static_cast<double>(background) * (1 - support::rounding(1));
  std::size_t different = 0;
  for (const auto& [from, to] : {std::pair{&a, &b}, {&b, &a}}) {
    auto accessor = to->getConstAccessor();
    for (auto it = from->cbeginValueOn(); it; ++it) {
      const bool atEnd = static_cast<double>(std::abs(*it)) > end;
      different += accessor.getValue(it.getCoord()) != *it;
      different += !atEnd && !accessor.isValueOn(it.getCoord());
    }
  }
  EXPECT_EQ(different, 0u) << name;
}

void expectSameByBlocks(const TriMesh& mesh, double voxel, MeshToBandOptions options,
                        const char* name) {
  const MeshToBandResult prisms = meshToBand(mesh, voxel, options);
  options.method = DistanceMethod::Blocks;
  expectSame(prisms.band, meshToBand(mesh, voxel, options).band, name);
}

TEST(PrismBand, MeasuresExactly) {
  const TriMesh torus = torusMesh(1, 0.4, 32, 16, V3d(0.013, -0.021, 0.007));
  expectExact(meshToBand(torus, 0.09, byPrisms(4.5)), torus, byWinding(torus));
  const TriMesh cube =
      transformed(boxMesh(V3d(-1), V3d(1)), [](const V3d& p) { return turned(p, 0.4); });
  expectExact(meshToBand(cube, 0.11, byPrisms(7)), cube, byWinding(cube));
}

TEST(PrismBand, HasTheBitsOfBlocks) {
  expectSameByBlocks(trefoilTube(0.4, 120, 12), 0.05, byPrisms(9), "knot");
  expectSameByBlocks(seaShell(61, 15), 0.02, byPrisms(6), "seashell");
  expectSameByBlocks(subdividedSphere(5), 0.04, byPrisms(3), "sphere");
  expectSameByBlocks(subdividedSphere(3), 0.03, byPrisms(25), "wide band");
  // Faces, edges and vertices on grid points.
  expectSameByBlocks(boxMesh(V3d(-4, -4, -4), V3d(4, 3, 5)), 0.5, byPrisms(4), "box");
}

TEST(PrismBand, HasTheBitsOfBlocksOnIrregularMeshes) {
  const TriMesh torus = torusMesh(1, 0.4, 20, 10);
  const auto winding = byPrisms(4, SignMode::Winding);
  expectSameByBlocks(soup(torus, 0.01), 0.15, winding, "soup");
  expectSameByBlocks(joined(torus, subdividedSphere(3)), 0.06, winding, "intersecting");
  TriMesh holed = torus;
  holed.triangles.resize(holed.triangles.size() - 40);
  expectSameByBlocks(holed, 0.06, winding, "hole");
  MeshToBandOptions part = byPrisms(4);
  part.roi.region = {V3d(0.2, -0.5, -0.5), V3d(1.5, 1.5, 0.5)};
  expectSameByBlocks(torus, 0.06, part, "region of interest");
  // Blocks that more than 48 triangles touch.
  expectSameByBlocks(subdividedSphere(6), 0.1, byPrisms(3), "small triangles");
}

TEST(PrismBand, HasTheSameBitsOnAnyNumberOfThreads) {
  const TriMesh mesh = trefoilTube(0.4, 60, 10);
  const auto on = [&](std::size_t threads) {
    return onThreads(threads, [&] { return meshToBand(mesh, 0.08, byPrisms(6)).band; });
  };
  EXPECT_EQ(on(1).contentHash(), on(4).contentHash());
}

TEST(PrismBand, StopsWhenCancelled) {
  MeshToBandOptions options = byPrisms(3);
  options.progress = [](double fraction) { return fraction < 0.7; };
  EXPECT_THROW((void)meshToBand(subdividedSphere(4), 0.03, options), Cancelled);
}

/// @param voxels  along the diagonal of the scan
void expectScanHasTheBitsOfBlocks(const char* name, double voxels, MeshToBandOptions options) {
  const std::filesystem::path file = std::filesystem::path(LEVELSMITH_DATA_DIR) / "models" / name;
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is missing: run data/fetch";
  const TriMesh mesh = readMesh(file);
  expectSameByBlocks(mesh, bounds(mesh).size().length() / voxels, options, name);
}

TEST(PrismBand, HasTheBitsOfBlocksOnScan) {
  expectScanHasTheBitsOfBlocks("bunny.obj", 160, byPrisms(8));
}

TEST(SlowPrismBand, HasTheBitsOfBlocksOnTheDragon) {
  expectScanHasTheBitsOfBlocks("dragon_vrip.ply.gz", 600, byPrisms(3, SignMode::Winding));
}

}  // namespace prism_band_test
