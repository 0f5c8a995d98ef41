#include "levelset/convert/pseudonormals.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "levelset/geometry/mesh_sides.h"

namespace levelset::convert {
namespace {

using Imath::V3d;

V3d directionOf(const V3d& v) {
  const double length = v.length();
  return length > 0 ? v / length : V3d(0);
}

double angleBetween(const V3d& a, const V3d& b) {
  return std::atan2(a.cross(b).length(), a.dot(b));
}

}  // namespace

Pseudonormals::Pseudonormals(const LocalMesh& mesh)
    : mesh_(mesh), vertices_(mesh.points.size()), edgeOf_(mesh.triangles.size()) {
  const std::size_t count = mesh.triangles.size();
  faces_.reserve(count);
  for (std::uint32_t t = 0; t < count; ++t) {
    const V3d &a = mesh.corner(t, 0), &b = mesh.corner(t, 1), &c = mesh.corner(t, 2);
    faces_.push_back(directionOf((b - a).cross(c - a)));
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t from = mesh.triangles[t][k], to = mesh.triangles[t][(k + 1) % 3];
      const V3d &at = mesh.points[from], &last = mesh.corner(t, (k + 2) % 3);
      vertices_[from].normal += faces_[t] * angleBetween(mesh.points[to] - at, last - at);
    }
  }
  const std::vector<MeshSide> sides = sortedSides(mesh.triangles);
  forEachEdge(sides, [&](auto first, auto end) {
    Direction edge;
    for (auto side = first; side != end; ++side) {
      edge.normal += faces_[side->triangle];
      edgeOf_[side->triangle][side->corner] = static_cast<std::uint32_t>(edges_.size());
    }
    const auto faces = static_cast<std::size_t>(end - first);
    edge.normal = directionOf(edge.normal);
    const bool isOriented = faces == 1 || (faces == 2 && first[0].rises != first[1].rises);
    edge.onBorder = faces == 1 || !isOriented;
    edges_.push_back(edge);
    borderEdges_ += faces == 1;
    if (edge.onBorder) vertices_[first->low].onBorder = vertices_[first->high].onBorder = true;
    if (!isOriented && !unorientedEdge_)
      unorientedEdge_ = UnorientedEdge{mesh.points[first->low], mesh.points[first->high], faces};
  });
  for (Direction& vertex : vertices_) vertex.normal = directionOf(vertex.normal);
}

Pseudonormals::Direction Pseudonormals::at(std::uint32_t triangle, int part) const {
  if (part == 6) return {faces_[triangle], false};
  const auto k = static_cast<std::size_t>(part % 3);
  return part < 3 ? vertices_[mesh_.triangles[triangle][k]] : edges_[edgeOf_[triangle][k]];
}

}  // namespace levelset::convert
