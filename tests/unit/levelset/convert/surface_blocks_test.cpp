#include "levelset/convert/surface_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <random>
#include <vector>

#include "levelset/mesh_sign/triangle_distance.h"

namespace surface_blocks_test {

using Imath::V3d;
using Imath::V3i;
using levelset::convert::LocalMesh;

using Visited = std::map<std::array<int, 3>, std::vector<std::uint32_t>>;

Visited visited(const LocalMesh& mesh, double reach) {
  Visited all;
  std::mutex mutex;
  levelset::convert::forEachBlock(
      mesh, reach,
      [&](const V3i& o, std::span<const std::uint32_t> candidates) {
        const std::lock_guard lock(mutex);
        all[{o.x, o.y, o.z}].assign(candidates.begin(), candidates.end());
      },
      {});
  return all;
}

/// Triangles of many sizes around random points.
LocalMesh randomTriangles(std::mt19937& random, double extent) {
  const auto pointIn = [&](double r) {
    std::uniform_real_distribution<double> between(-r, r);
    return V3d(between(random), between(random), between(random));
  };
  LocalMesh mesh;
  for (std::uint32_t i = 0; i < 24; ++i) {
    const V3d at = pointIn(extent);
    const double size = std::array{0.3, 2.0, 20.0}[i % 3];
    for (int corner = 0; corner < 3; ++corner) mesh.points.push_back(at + pointIn(size));
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

TEST(SurfaceBlocks, HaveAllTrianglesWithinReach) {
  // Bounding boxes are stored in 16 bits. Their unit is below a voxel for small meshes and many
  // voxels for large ones.
  std::mt19937 random(1);
  std::size_t wanted = 0;
  for (const double extent : {1.0, 60.0, 4000.0, 32760.0, 1e6}) {
    const LocalMesh mesh = randomTriangles(random, extent);
    const double reach = 4.25;
    const Visited blocks = visited(mesh, reach);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      const V3d &a = mesh.corner(t, 0), &b = mesh.corner(t, 1), &c = mesh.corner(t, 2);
      const levelset::convert::TriangleFrame frame(a, b, c);
      V3i low, high;
      for (int i = 0; i < 3; ++i) {
        low[i] = static_cast<int>(std::floor((std::min({a[i], b[i], c[i]}) - reach) / 8)) * 8;
        high[i] = static_cast<int>(std::floor((std::max({a[i], b[i], c[i]}) + reach) / 8)) * 8;
      }
      for (int x = low.x; x <= high.x; x += 8)
        for (int y = low.y; y <= high.y; y += 8)
          for (int z = low.z; z <= high.z; z += 8) {
            bool isNear = false;
            for (int n = 0; n < 512 && !isNear; ++n)
              isNear =
                  frame.squaredDistance(V3d(x + n / 64, y + n / 8 % 8, z + n % 8)) <= reach * reach;
            if (!isNear) continue;
            ++wanted;
            const auto block = blocks.find({x, y, z});
            ASSERT_NE(block, blocks.end()) << extent;
            EXPECT_TRUE(std::binary_search(block->second.begin(), block->second.end(), t))
                << extent;
          }
    }
  }
  EXPECT_GT(wanted, 1000u);
}

TEST(SurfaceBlocks, OmitTrianglesFarFromTheBlock) {
  // Far from the origin, a unit of the stored boxes has two voxels.
  for (const double x : {0.0, 60000.0}) {
    LocalMesh mesh;
    mesh.points = {V3d(x, 4, 4), V3d(x + 1, 4, 4), V3d(x, 5, 4)};
    mesh.triangles = {{0, 1, 2}};
    EXPECT_LE(visited(mesh, 2).size(), x == 0 ? 2u : 8u) << x;
  }
}

}  // namespace surface_blocks_test
