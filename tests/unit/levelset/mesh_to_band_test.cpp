#include "levelset/convert/mesh_to_band.h"

#include <gtest/gtest.h>
#include <openvdb/tools/Diagnostics.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <mutex>

#include "levelset/error.h"
#include "levelset/vdb.h"
#include "tests/support/meshes.h"

namespace {

using namespace levelset;
using namespace support;

using Inside = std::function<bool(const V3d&)>;

/// By the exact winding number, which the points are taken not to lie on the edge of.
Inside byWinding(const TriMesh& mesh, double flip = 1) {
  return [&mesh, flip](const V3d& p) { return flip * windingNumber(mesh, p) > 0.5; };
}

/// Compares every grid point around the mesh with brute force: which are active, how far, which
/// side.
void expectExact(const MeshToBandResult& result, const TriMesh& mesh, const Inside& inside) {
  const openvdb::FloatGrid& grid = vdb(result.band);
  const double h = result.band.voxelSize(), halfWidth = result.band.halfWidth();
  const Imath::Box3d box = bounds(mesh);
  const int pad = static_cast<int>(halfWidth) + 2;
  const auto cell = [&](double x) { return static_cast<int>(std::floor(x / h)); };
  std::mutex mutex;
  std::size_t active = 0;
  double worst = 0;
  tbb::parallel_for(cell(box.min.x) - pad, cell(box.max.x) + pad + 1, [&](int x) {
    auto accessor = grid.getConstAccessor();
    for (int y = cell(box.min.y) - pad; y <= cell(box.max.y) + pad; ++y)
      for (int z = cell(box.min.z) - pad; z <= cell(box.max.z) + pad; ++z) {
        const V3d p = V3d(x, y, z) * h;
        const double exact = unsignedDistance(mesh, p);
        const bool isActive = accessor.isValueOn({x, y, z});
        const double value = static_cast<double>(accessor.getValue({x, y, z}));
        const bool isInside = inside(p);
        const std::lock_guard lock(mutex);
        active += isActive;
        if (std::abs(exact - halfWidth * h) > 1e-6 * h) {
          ASSERT_EQ(isActive, exact < halfWidth * h) << p << " at " << exact;
        }
        worst = std::max(worst, std::abs(std::abs(value) - std::min(exact, halfWidth * h)));
        if (exact > 1e-6 * h) {
          ASSERT_EQ(value < 0, isInside) << p << " at " << exact;
        }
      }
  });
  EXPECT_EQ(active, result.band.activeVoxelCount());
  EXPECT_LT(worst, 1e-4 * h);
}

MeshToBandResult closed(const TriMesh& mesh, double h, Nesting nesting = Nesting::Parity) {
  return meshToBand(mesh, h, {.sign = SignMode::Closed, .nesting = nesting});
}

TEST(MeshToBand, MeasuresExactlyAroundTorus) {
  const TriMesh mesh = torusMesh(1, 0.4, 32, 16, V3d(0.013, -0.021, 0.007));
  const auto result = closed(mesh, 0.09);
  expectExact(result, mesh, byWinding(mesh));
  EXPECT_TRUE(result.certificate.closed);
  EXPECT_EQ(result.certificate.method, SignMode::Closed);
}

TEST(MeshToBand, MeasuresExactlyAroundTurnedCube) {
  const TriMesh mesh =
      transformed(boxMesh(V3d(-1), V3d(1)), [](const V3d& p) { return turned(p, 0.4); });
  expectExact(closed(mesh, 0.11), mesh, byWinding(mesh));
  expectExact(meshToBand(mesh, 0.11, {.halfWidth = 5.5, .sign = SignMode::Winding}), mesh,
              byWinding(mesh));
}

TEST(MeshToBand, CountsCubeOnGridLinesOnce) {
  // Faces, edges and vertices of the mesh all fall on grid lines and points.
  const TriMesh mesh = boxMesh(V3d(-4, -4, -4), V3d(4, 3, 5));
  expectExact(closed(mesh, 1), mesh, byWinding(mesh));
  expectExact(closed(mesh, 0.5), mesh, byWinding(mesh));
}

TEST(MeshToBand, MatchesWindingNumberOfNestedShells) {
  const TriMesh outer = sphereMesh(1, V3d(0.01, 0.02, 0.03), 12);
  const TriMesh same = joined(outer, sphereMesh(0.5, V3d(0), 10));
  const TriMesh cavity = joined(outer, reversed(sphereMesh(0.5, V3d(0), 10)));
  const double h = 0.09;
  const auto winding = [&](const TriMesh& mesh) {
    return meshToBand(mesh, h, {.sign = SignMode::Winding});
  };
  expectExact(winding(cavity), cavity, byWinding(cavity));
  expectExact(winding(same), same, byWinding(same));
  // Parity keeps the cavity whichever way the inner shell faces, orientation follows it.
  expectExact(closed(same, h), cavity, byWinding(cavity));
  expectExact(closed(cavity, h), cavity, byWinding(cavity));
  expectExact(closed(cavity, h, Nesting::Orientation), cavity, byWinding(cavity));
  expectExact(closed(same, h, Nesting::Orientation), same, byWinding(same));
}

}  // namespace
