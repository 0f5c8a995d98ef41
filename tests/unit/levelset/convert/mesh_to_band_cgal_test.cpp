// Compares distances and signs with CGAL's triangle tree, an independent implementation. Built as a
// separate executable, because CGAL requires -frounding-math.

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/vdb.h"
#include "tests/support/meshes.h"

namespace mesh_to_band_cgal_test {

using namespace levelset;
using Kernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

/// CGAL's answers about a closed mesh: distance and side.
class Oracle {
 public:
  explicit Oracle(const TriMesh& mesh) {
    for (const auto& t : mesh.triangles)
      triangles_.emplace_back(point(mesh.positions[t[0]]), point(mesh.positions[t[1]]),
                              point(mesh.positions[t[2]]));
    std::erase_if(triangles_, [](const auto& t) { return t.is_degenerate(); });
    tree_.insert(triangles_.begin(), triangles_.end());
    tree_.accelerate_distance_queries();
  }

  [[nodiscard]] double distance(const Imath::V3d& p) const {
    return std::sqrt(tree_.squared_distance(point(p)));
  }
  /// Parity of the intersections along a ray. Two of three rays in odd directions must agree,
  /// because one of them may graze an edge.
  [[nodiscard]] bool isInside(const Imath::V3d& p) const {
    const auto odd = [&](double x, double y, double z) {
      const Kernel::Ray_3 ray(point(p), Kernel::Vector_3(x, y, z));
      return tree_.number_of_intersected_primitives(ray) % 2 == 1;
    };
    const bool first = odd(0.8641, 0.3517, 0.2713), second = odd(-0.2931, 0.7717, -0.5639);
    return first == second ? first : odd(0.1733, -0.6197, 0.7649);
  }

 private:
  static Kernel::Point_3 point(const Imath::V3d& p) { return {p.x, p.y, p.z}; }
  Triangles triangles_;
  Tree tree_;
};

/// Checks every voxel of the band with its sign, the signs beyond the band, and that no voxel is
/// missing. Each vertex must lie between active grid points. An inactive neighbour of an active
/// grid point must lie beyond the half width.
void expectExact(const TriMesh& mesh, double h, SignMode sign) {
  const Oracle oracle(mesh);
  const auto result = meshToBand(mesh, h, {.sign = sign});
  const openvdb::FloatGrid& grid = vdb(result.band);
  const auto place = [h](const openvdb::Coord& c) { return toImath(c.asVec3d()) * h; };
  auto accessor = grid.getConstAccessor();
  double worst = 0;
  std::ptrdiff_t count = 0, wrong = 0, missing = 0;
  for (auto it = grid.cbeginValueOn(); it; ++it, ++count) {
    const openvdb::Coord c = it.getCoord();
    const double exact = oracle.distance(place(c));
    worst = std::max(worst, std::abs(std::abs(static_cast<double>(*it)) - exact));
    if (exact > 1e-6 * h) wrong += (*it < 0) != oracle.isInside(place(c));
    if (exact < 2 * h) continue;  // its neighbours are within the half width
    for (int n = 0; n < 27; ++n) {
      const openvdb::Coord next = c.offsetBy(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1);
      if (accessor.isValueOn(next)) continue;
      missing += oracle.distance(place(next)) < (result.band.halfWidth() - 1e-6) * h;
    }
  }
  // Beyond the band only the side is stored: in every tile, and in some of the inactive voxels.
  std::ptrdiff_t beyond = 0;
  for (auto it = grid.cbeginValueOff(); it; ++it) {
    if (it.isVoxelValue() && beyond++ % 41 != 0) continue;
    const openvdb::CoordBBox box = it.getBoundingBox();
    for (const openvdb::Coord& c : {box.min(), box.max()})
      wrong += (*it < 0) != oracle.isInside(place(c));
  }
  for (const Imath::V3d& p : mesh.positions)
    missing += !accessor.isValueOn(openvdb::Coord::floor(openvdb::Vec3d(p.x, p.y, p.z) / h));
  EXPECT_GT(count, 10000);
  EXPECT_LT(worst, 1e-4 * h);
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(missing, 0);
}

TEST(MeshToBandCgal, AgreesOnTorus) {
  expectExact(support::torusMesh(1, 0.4), 0.04, SignMode::Closed);
}

TEST(MeshToBandCgal, AgreesOnTurnedCube) {
  expectExact(support::transformed(support::boxMesh(Imath::V3d(-1), Imath::V3d(1)),
                                   [](const Imath::V3d& p) { return support::turned(p, 0.4); }),
              0.05, SignMode::Closed);
}

TEST(MeshToBandCgal, AgreesOnBunny) {
  const std::filesystem::path file =
      std::filesystem::path(LEVELSMITH_DATA_DIR) / "models/bunny.obj";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is missing: run data/fetch";
  const TriMesh mesh = readMesh(file);
  const Imath::V3d size = bounds(mesh).size();
  for (const SignMode sign : {SignMode::Closed, SignMode::Winding})
    expectExact(mesh, std::max({size.x, size.y, size.z}) / 75, sign);
}

}  // namespace mesh_to_band_cgal_test
