// Compares geodesics with CGAL's exact geodesics on a mesh of the same zero set, an independent
// implementation. Built as a separate executable, because CGAL requires -frounding-math.

#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_shortest_path.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/shapes/shapes.h"
#include "mapping/surface/geodesic.h"
#include "mapping/surface/surface_projection.h"
#include "tests/support/meshes.h"

namespace geodesic_cgal_test {

using Imath::V3d;
using levelset::NarrowBand;
using Kernel = CGAL::Simple_cartesian<double>;
using Polyhedron = CGAL::Surface_mesh<Kernel::Point_3>;
using ShortestPath =
    CGAL::Surface_mesh_shortest_path<CGAL::Surface_mesh_shortest_path_traits<Kernel, Polyhedron>>;
using TreeTraits = CGAL::AABB_traits<Kernel, CGAL::AABB_face_graph_triangle_primitive<Polyhedron>>;

/// Shortest paths on a mesh.
class Judge {
 public:
  explicit Judge(const levelset::TriMesh& mesh) {
    std::vector<Polyhedron::Vertex_index> vertices;
    for (const V3d& p : mesh.positions) vertices.push_back(mesh_.add_vertex({p.x, p.y, p.z}));
    for (const auto& t : mesh.triangles)
      mesh_.add_face(vertices[t[0]], vertices[t[1]], vertices[t[2]]);
    paths_ = std::make_unique<ShortestPath>(mesh_);
    paths_->build_aabb_tree(tree_);
  }
  void startAt(const V3d& p) {
    paths_->remove_all_source_points();
    paths_->add_source_point(locate(p));
  }
  [[nodiscard]] double distanceTo(const V3d& p) {
    const auto place = locate(p);
    return paths_->shortest_distance_to_source_points(place.first, place.second).first;
  }

 private:
  ShortestPath::Face_location locate(const V3d& p) {
    return paths_->locate<TreeTraits>(Kernel::Point_3(p.x, p.y, p.z), tree_);
  }
  Polyhedron mesh_;
  CGAL::AABB_tree<TreeTraits> tree_;
  std::unique_ptr<ShortestPath> paths_;
};

/// Largest relative difference from the mesh's path length, over all pairs of positions.
double worstDifference(const NarrowBand& band, const levelset::TriMesh& mesh,
                       std::vector<V3d> places) {
  Judge judge(mesh);
  const mapping::SurfaceField field(band);
  for (V3d& p : places) p = mapping::closestSurfacePoint(band, p);
  double worst = 0;
  for (std::size_t i = 0; i + 1 < places.size(); ++i) {
    judge.startAt(places[i]);
    for (std::size_t j = i + 1; j < places.size(); ++j) {
      const double exact = judge.distanceTo(places[j]);
      const std::vector<V3d> path = mapping::geodesic(field, 0, places[i], places[j]);
      if (path.empty()) return HUGE_VAL;
      worst = std::max(worst, std::abs(mapping::pathLength(path) / exact - 1));
    }
  }
  return worst;
}

TEST(GeodesicCgal, AgreesOnABox) {
  // Between some of these, paths over three, four and five faces differ by one or two per cent.
  const std::vector<V3d> places = {V3d(-15, 0.5, 5), V3d(15, -0.3, -4), V3d(3, -2, 6),
                                   V3d(4, 6, 1)};
  const levelset::TriMesh mesh = support::boxMesh(V3d(-15, -6, -6), V3d(15, 6, 6));
  for (const double voxel : {0.75, 0.5, 0.375})
    EXPECT_LT(worstDifference(levelset::makeBox(V3d(30, 12, 12), V3d(0), voxel), mesh, places),
              0.01)
        << voxel;
}

TEST(GeodesicCgal, AgreesOnATorus) {
  // Paths around, through and over the tube of similar lengths.
  const std::vector<V3d> places = {V3d(2.7, 0, 0), V3d(-1.3, 0.2, 0), V3d(-1.9, -1.9, 0.1)};
  const levelset::TriMesh mesh = support::torusMesh(2, 0.7, 72, 30);
  for (const double voxel : {0.2, 0.14, 0.1})
    EXPECT_LT(
        worstDifference(levelset::makeTorus(2, 0.7, V3d(0), V3d(0, 0, 1), voxel), mesh, places),
        0.01)
        << voxel;
}

TEST(SlowGeodesicCgal, AgreesOnTheBunny) {
  const std::filesystem::path file =
      std::filesystem::path(LEVELSMITH_DATA_DIR) / "models/bunny.obj";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no " << file << "; `./dev fetch` brings it";
  const levelset::TriMesh bunny = levelset::readMesh(file);
  const Imath::Box3d box = levelset::bounds(bunny);
  // Both ears, face, back and tail.
  std::vector<V3d> places;
  for (const V3d& share : {V3d(0.2, 0.95, 0.3), V3d(0.45, 0.95, 0.2), V3d(0.1, 0.6, 0.7),
                           V3d(0.7, 0.5, 0.9), V3d(0.95, 0.2, 0.4)})
    places.push_back(box.min + box.size() * share);
  for (const double resolution : {40.0, 50.0, 60.0}) {
    const NarrowBand band =
        levelset::meshToBand(bunny, box.size().length() / 1.6 / resolution, {}).band;
    EXPECT_LT(worstDifference(band, levelset::bandToMesh(band), places), 0.01) << resolution;
  }
}

}  // namespace geodesic_cgal_test
