#include "levelset/geometry/vertex_normals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace levelset {

using Imath::V3d;

std::vector<V3d> vertexNormals(const TriMesh& mesh, double creaseAngle) {
  std::vector<V3d> normals(mesh.positions.size(), V3d(0));
  // Zero for slivers, whose normals are mostly rounding.
  const auto across = [&](const std::array<std::uint32_t, 3>& t) {
    const V3d &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    const double longest = std::max({(b - a).length2(), (c - b).length2(), (a - c).length2()});
    const V3d normal = (b - a).cross(c - a);
    constexpr double kSliver = 1e-3;
    return normal.length() < kSliver * longest ? V3d(0) : normal.normalized();
  };
  for (const auto& t : mesh.triangles) {
    const V3d normal = across(t);
    for (std::size_t k = 0; k < 3; ++k) {
      const V3d &at = mesh.positions[t[k]], u = mesh.positions[t[(k + 1) % 3]] - at,
                v = mesh.positions[t[(k + 2) % 3]] - at;
      normals[t[k]] += normal * std::atan2(u.cross(v).length(), u.dot(v));
    }
  }
  for (V3d& normal : normals) normal.normalize();
  std::vector<char> isCrease(normals.size(), 0);
  const double least = std::cos(creaseAngle);
  for (const auto& t : mesh.triangles) {
    const V3d normal = across(t);
    if (normal == V3d(0)) continue;
    for (const std::uint32_t corner : t)
      if (normals[corner].dot(normal) < least) isCrease[corner] = 1;
  }
  for (std::size_t i = 0; i < normals.size(); ++i)
    if (isCrease[i]) normals[i] = V3d(0);
  return normals;
}

}  // namespace levelset
