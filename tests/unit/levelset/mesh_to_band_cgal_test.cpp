// Distances against CGAL's tree of triangles, an implementation that shares nothing with ours. In
// an executable of its own: CGAL asks for -frounding-math.

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "levelset/convert/mesh_file.h"
#include "levelset/convert/mesh_to_band.h"
#include "levelset/vdb.h"
#include "tests/support/meshes.h"

namespace mesh_to_band_cgal_test {

using namespace levelset;
using Kernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

/// Every voxel of the band and, `stride` apart, its sign.
void expectExact(const TriMesh& mesh, double h, std::ptrdiff_t stride) {
  Triangles triangles;
  const auto point = [](const Imath::V3d& p) { return Kernel::Point_3(p.x, p.y, p.z); };
  for (const auto& t : mesh.triangles)
    triangles.emplace_back(point(mesh.positions[t[0]]), point(mesh.positions[t[1]]),
                           point(mesh.positions[t[2]]));
  std::erase_if(triangles, [](const auto& t) { return t.is_degenerate(); });
  Tree tree(triangles.begin(), triangles.end());
  tree.accelerate_distance_queries();

  const auto result = meshToBand(mesh, h, {.sign = SignMode::Closed});
  double worst = 0;
  std::ptrdiff_t count = 0, wrong = 0;
  for (auto it = vdb(result.band).cbeginValueOn(); it; ++it, ++count) {
    const Imath::V3d p = toImath(it.getCoord().asVec3d()) * h;
    const double exact = std::sqrt(tree.squared_distance(point(p)));
    worst = std::max(worst, std::abs(std::abs(static_cast<double>(*it)) - exact));
    if (count % stride == 0 && exact > 1e-6 * h)
      wrong += (*it < 0) != (windingNumber(mesh, p) > 0.5);
  }
  EXPECT_GT(count, 10000);
  EXPECT_LT(worst, 1e-4 * h);
  EXPECT_EQ(wrong, 0);
}

TEST(MeshToBandCgal, AgreesOnTorus) {
  expectExact(support::torusMesh(1, 0.4), 0.04, 10);
}

TEST(MeshToBandCgal, AgreesOnTurnedCube) {
  expectExact(support::transformed(support::boxMesh(Imath::V3d(-1), Imath::V3d(1)),
                                   [](const Imath::V3d& p) { return support::turned(p, 0.4); }),
              0.05, 1);
}

TEST(MeshToBandCgal, AgreesOnBunny) {
  const std::filesystem::path file =
      std::filesystem::path(LEVELSMITH_DATA_DIR) / "models/bunny.obj";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is missing: run data/fetch";
  const TriMesh mesh = readMesh(file);
  const Imath::V3d size = bounds(mesh).size();
  expectExact(mesh, std::max({size.x, size.y, size.z}) / 150, 1000);
}

}  // namespace mesh_to_band_cgal_test
