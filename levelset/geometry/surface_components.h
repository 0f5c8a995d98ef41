#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "levelset/geometry/disjoint_sets.h"

/// Surface components (connected pieces) of a triangle mesh, for any vector type with []. Internal.
namespace levelset {

struct ComponentFigures {
  double volume = 0;  ///< signed volume that the component encloses; negative for a cavity
  double area = 0;
  long euler = 0;  ///< Euler characteristic V − E + F, valid if each edge has two triangles
};

struct SurfaceComponents {
  std::vector<ComponentFigures> figures;  ///< one entry for each component, ordered by first vertex
  std::vector<std::uint32_t> componentOfVertex;  ///< component number; kNoComponent: no triangle
  static constexpr std::uint32_t kNoComponent = 0xffffffffu;
};

namespace components_detail {

using Triple = std::array<double, 3>;

template <typename Vector>
Triple difference(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

inline Triple cross(const Triple& a, const Triple& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline double dot(const Triple& a, const Triple& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

}  // namespace components_detail

/// Finds the surface components. Volumes are computed relative to a vertex of each component and
/// summed in triangle order.
template <typename Vector>
SurfaceComponents findSurfaceComponents(
    const std::vector<Vector>& positions,
    const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  using namespace components_detail;
  DisjointSets sets(positions.size());
  SurfaceComponents components;
  components.componentOfVertex.assign(positions.size(), SurfaceComponents::kNoComponent);
  for (const auto& t : triangles) {
    sets.join(t[0], t[1]);
    sets.join(t[0], t[2]);
    for (const std::uint32_t v : t) components.componentOfVertex[v] = 0;  // in use
  }
  std::vector<std::uint32_t> anchors;
  for (std::uint32_t v = 0; v < positions.size(); ++v) {
    if (components.componentOfVertex[v] == SurfaceComponents::kNoComponent) continue;
    // Lowest vertex of the component: it comes first, so the component has its number already.
    const std::uint32_t top = sets.find(v);
    if (top == v) {
      components.componentOfVertex[v] = static_cast<std::uint32_t>(anchors.size());
      anchors.push_back(v);
      components.figures.emplace_back();
    } else {
      components.componentOfVertex[v] = components.componentOfVertex[top];
    }
    ++components.figures[components.componentOfVertex[v]].euler;
  }
  std::vector<std::size_t> faces(anchors.size(), 0);
  for (const auto& t : triangles) {
    const std::uint32_t component = components.componentOfVertex[t[0]];
    const Vector& anchor = positions[anchors[component]];
    const Triple a = difference(positions[t[0]], anchor),
                 ab = difference(positions[t[1]], positions[t[0]]),
                 ac = difference(positions[t[2]], positions[t[0]]);
    const Triple normal = cross(ab, ac);
    components.figures[component].volume += dot(a, normal) / 6;
    components.figures[component].area += std::sqrt(dot(normal, normal)) / 2;
    ++faces[component];
  }
  // Each edge has two triangles: 3F = 2E.
  for (std::size_t i = 0; i < faces.size(); ++i) {
    components.figures[i].euler -= static_cast<long>(faces[i] / 2);
  }
  return components;
}

}  // namespace levelset
