#pragma once

#include <Imath/ImathVec.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "levelset/mesh.h"
#include "levelset/mesh_sign/self_intersections.h"

/// The explicit offset of shell maps [Porumbescu05], to compare the volumetric layers of a patch
/// with: vertices move along their normals, and retreat where triangles collide.
namespace vertex_offset {

/// Unit normals of the vertices: sums of the normals of their triangles, weighted by the angles at
/// the vertex [Baerentzen05].
inline std::vector<Imath::V3d> vertexNormals(const levelset::TriMesh& mesh) {
  using Imath::V3d;
  std::vector<V3d> normals(mesh.positions.size(), V3d(0));
  for (const auto& triangle : mesh.triangles)
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const V3d at = mesh.positions[triangle[corner]];
      const V3d a = mesh.positions[triangle[(corner + 1) % 3]] - at,
                b = mesh.positions[triangle[(corner + 2) % 3]] - at, normal = a.cross(b);
      normals[triangle[corner]] += normal.normalized() * std::atan2(normal.length(), a.dot(b));
    }
  for (V3d& normal : normals) normal.normalize();
  return normals;
}

struct Result {
  levelset::TriMesh mesh;
  std::vector<double> reached;  ///< distance of each vertex from its start, world units
  std::size_t locked = 0;       ///< number of vertices that retreated
};

/// Moves all vertices by `distance` at once. Triangles may then pass through each other.
inline Result offsetAtOnce(const levelset::TriMesh& base, double distance) {
  Result result{base, std::vector<double>(base.positions.size(), distance)};
  const std::vector<Imath::V3d> normals = vertexNormals(base);
  for (std::size_t v = 0; v < normals.size(); ++v)
    result.mesh.positions[v] += normals[v] * distance;
  return result;
}

/// Moves the vertices in equal steps. The vertices of triangles that intersect after a step go back
/// by that step and stay there. This is repeated until nothing intersects, so the result has no
/// intersections if the base has none.
inline Result offsetWithRetreat(const levelset::TriMesh& base, double distance, int steps) {
  const std::vector<Imath::V3d> normals = vertexNormals(base);
  Result result{base, std::vector<double>(base.positions.size(), 0)};
  std::vector<char> isLocked(base.positions.size(), 0);
  const auto place = [&](std::size_t v) {
    result.mesh.positions[v] = base.positions[v] + normals[v] * result.reached[v];
  };
  for (int step = 1; step <= steps; ++step) {
    const double before = distance * (step - 1) / steps, after = distance * step / steps;
    for (std::size_t v = 0; v < normals.size(); ++v)
      if (!isLocked[v]) result.reached[v] = after, place(v);
    for (bool retreats = true; retreats;) {
      retreats = false;
      for (const auto& [first, second] : levelset::convert::findSelfIntersections(
               result.mesh.triangles, result.mesh.positions, {}))
        for (const std::uint32_t triangle : {first, second})
          for (const std::uint32_t v : result.mesh.triangles[triangle]) {
            if (isLocked[v]) continue;
            isLocked[v] = 1, result.reached[v] = before, place(v);
            retreats = true;
          }
    }
  }
  result.locked = static_cast<std::size_t>(std::count(isLocked.begin(), isLocked.end(), 1));
  return result;
}

}  // namespace vertex_offset
