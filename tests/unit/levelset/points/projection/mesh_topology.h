#pragma once

#include <array>
#include <map>
#include <set>

#include "levelset/mesh.h"

namespace projected_points {

/// Topology of a mesh.
struct Topology {
  long euler = 0;
  std::size_t borderEdges = 0;
  bool isManifold = true;  ///< each directed edge once, and one fan at each vertex
};

inline Topology topologyOf(const levelset::TriMesh& mesh) {
  Topology result;
  std::set<std::array<std::uint32_t, 2>> sides;
  std::map<std::uint32_t, std::size_t> triangles, borders;
  for (const auto& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      if (!sides.insert({t[i], t[(i + 1) % 3]}).second) result.isManifold = false;
      ++triangles[t[i]];
    }
  std::size_t edges = 0;
  for (const auto& [a, b] : sides) {
    const bool isBorder = !sides.contains({b, a});
    edges += isBorder || a < b;
    if (!isBorder) continue;
    ++result.borderEdges;
    if (++borders[a] > 1) result.isManifold = false;
  }
  result.euler = static_cast<long>(mesh.positions.size()) - static_cast<long>(edges) +
                 static_cast<long>(mesh.triangles.size());
  if (triangles.size() != mesh.positions.size()) result.isManifold = false;
  return result;
}

}  // namespace projected_points
