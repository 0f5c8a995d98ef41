#pragma once

// Comparison of bands from meshes with brute force, for tests.

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <functional>
#include <mutex>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/vdb.h"
#include "tests/support/measured.h"
#include "tests/support/meshes.h"

namespace support {

using Inside = std::function<bool(const V3d&)>;

/// Inside test by the exact winding number. The points must not lie on the edge of the mesh.
inline Inside byWinding(const TriMesh& mesh, double flip = 1) {
  return [&mesh, flip](const V3d& p) { return flip * levelset::windingNumber(mesh, p) > 0.5; };
}

/// Compares every grid point around the mesh with brute force: whether it is active, its distance,
/// and its side.
inline void expectExact(const levelset::MeshToBandResult& result, const TriMesh& mesh,
                        const Inside& inside) {
  const openvdb::FloatGrid& grid = levelset::vdb(result.band);
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
  EXPECT_LT(worst, support::rounding(4) * h);
}

/// Checks the band of an open mesh. Signs follow the exact winding number, and every sign change
/// lies between active voxels. No value exceeds the distance to the mesh, and the surface lies
/// where the winding number passes 1/2.
inline void expectOpenSound(const levelset::MeshToBandResult& result, const TriMesh& mesh) {
  const openvdb::FloatGrid& grid = levelset::vdb(result.band);
  const double h = result.band.voxelSize();
  auto accessor = grid.getConstAccessor();
  std::size_t wrong = 0, loose = 0, beyond = 0;
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  for (auto it = box.begin(); it; ++it) {
    const openvdb::Coord c = *it;
    const V3d p = V3d(c.x(), c.y(), c.z()) * h;
    const float value = accessor.getValue(c);
    const double w = levelset::windingNumber(mesh, p), distance = unsignedDistance(mesh, p);
    wrong += std::abs(w - 0.5) > 1e-9 && distance > 1e-6 * h && (value < 0) != (w > 0.5);
    beyond += std::abs(static_cast<double>(value)) > std::max(distance, 0.0) + 1e-4 * h;
    for (int axis = 0; axis < 3; ++axis) {
      openvdb::Coord next = c;
      next[axis] += 1;
      const bool changes = (accessor.getValue(next) < 0) != (value < 0);
      loose += changes && !(accessor.isValueOn(c) && accessor.isValueOn(next));
    }
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_EQ(loose, 0u);
  EXPECT_EQ(beyond, 0u);
}

}  // namespace support
