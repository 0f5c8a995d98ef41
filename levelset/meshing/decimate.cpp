#include "levelset/meshing/decimate.h"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <cassert>

namespace levelset {
namespace {

struct DoubleTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};
using HalfedgeMesh = OpenMesh::TriMesh_ArrayKernelT<DoubleTraits>;

/// Largest sum of the valences of both ends of an edge that may collapse. Without a limit, flat
/// parts become fans of thousands of triangles, and each further collapse visits all of them.
constexpr unsigned kMaxValences = 24;

/// Quadric module that accepts rounding errors. The quadric of a flat part is zero up to rounding.
/// If it is slightly negative, OpenMesh would forbid the collapse.
template <typename AnyMesh>
class FlatQuadric : public OpenMesh::Decimater::ModQuadricT<AnyMesh> {
 public:
  DECIMATING_MODULE(FlatQuadric, AnyMesh, FlatQuadric);
  explicit FlatQuadric(AnyMesh& mesh) : OpenMesh::Decimater::ModQuadricT<AnyMesh>(mesh) {}

  float collapse_priority(const CollapseInfo& collapse) override {
    if (collapse.mesh.valence(collapse.v0) + collapse.mesh.valence(collapse.v1) > kMaxValences) {
      return float(Base::ILLEGAL_COLLAPSE);
    }
    const float priority = OpenMesh::Decimater::ModQuadricT<AnyMesh>::collapse_priority(collapse);
    const bool isRounding = priority < 0 && priority > float(Base::ILLEGAL_COLLAPSE) / 2;
    return isRounding ? 0 : priority;
  }
};

/// Largest rotation of a triangle's normal in one collapse.
constexpr float kMaxTurnDegrees = 45;

HalfedgeMesh toHalfedges(const IndexMesh& mesh) {
  HalfedgeMesh result;
  result.reserve(mesh.positions.size(), mesh.triangles.size() * 3 / 2, mesh.triangles.size());
  for (const openvdb::Vec3d& p : mesh.positions) {
    result.add_vertex(OpenMesh::Vec3d(p.x(), p.y(), p.z()));
  }
  for (const auto& t : mesh.triangles) {
    [[maybe_unused]] const auto face = result.add_face(
        result.vertex_handle(t[0]), result.vertex_handle(t[1]), result.vertex_handle(t[2]));
    assert(face.is_valid());
  }
  return result;
}

IndexMesh fromHalfedges(const HalfedgeMesh& mesh) {
  IndexMesh result;
  result.positions.reserve(mesh.n_vertices());
  result.triangles.reserve(mesh.n_faces());
  for (const auto vertex : mesh.vertices()) {
    const OpenMesh::Vec3d& p = mesh.point(vertex);
    result.positions.emplace_back(p[0], p[1], p[2]);
  }
  for (const auto face : mesh.faces()) {
    std::array<std::uint32_t, 3> triangle = {};
    std::size_t corner = 0;
    for (const auto vertex : mesh.fv_range(face)) {
      triangle[corner++] = static_cast<std::uint32_t>(vertex.idx());
    }
    result.triangles.push_back(triangle);
  }
  return result;
}

}  // namespace

IndexMesh decimate(const IndexMesh& mesh, double tolerance) {
  HalfedgeMesh halfedges = toHalfedges(mesh);
  halfedges.request_face_normals();
  halfedges.update_face_normals();
  OpenMesh::Decimater::DecimaterT<HalfedgeMesh> decimater(halfedges);
  FlatQuadric<HalfedgeMesh>::Handle quadric;
  OpenMesh::Decimater::ModNormalFlippingT<HalfedgeMesh>::Handle turning;
  decimater.add(quadric);
  decimater.add(turning);
  // The quadric is the sum of the squared distances to the planes of the merged triangles, so each
  // distance is at most `tolerance`.
  decimater.module(quadric).set_max_err(tolerance * tolerance, false);
  decimater.module(turning).set_max_normal_deviation(kMaxTurnDegrees);
  decimater.initialize();
  decimater.decimate();
  halfedges.garbage_collection();
  return fromHalfedges(halfedges);
}

}  // namespace levelset
