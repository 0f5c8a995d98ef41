#pragma once

// Two-sided distance between the triangles of a result and a surface in closed form.

#include <Imath/ImathVec.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "levelset/inspect/surface_difference.h"
#include "levelset/mesh.h"

namespace support {

using Imath::V3d;

/// Surface in closed form.
struct ExactSurface {
  std::function<double(const V3d&)> distance;  ///< with or without sign
  std::vector<V3d> points;                     ///< dense samples of the surface
};

inline ExactSurface exactSphere(double radius) {
  ExactSurface sphere{[=](const V3d& p) { return p.length() - radius; }, {}};
  constexpr int kCount = 60000;  // points of a spiral from pole to pole
  for (int i = 0; i < kCount; ++i) {
    const double z = 1 - (2.0 * i + 1) / kCount, r = std::sqrt(1 - z * z),
                 angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
    sphere.points.push_back(V3d(r * std::cos(angle), r * std::sin(angle), z) * radius);
  }
  return sphere;
}

inline ExactSurface exactTorus(double radius, double tube) {
  ExactSurface torus{
      [=](const V3d& p) { return std::hypot(std::hypot(p.x, p.y) - radius, p.z) - tube; }, {}};
  for (int i = 0; i < 480; ++i)
    for (int j = 0; j < 160; ++j) {
      const double u = 2 * std::numbers::pi * i / 480, v = 2 * std::numbers::pi * j / 160,
                   r = radius + tube * std::cos(v);
      torus.points.emplace_back(r * std::cos(u), r * std::sin(u), tube * std::sin(v));
    }
  return torus;
}

/// Faces of a box about the origin. Only parts farther than `margin` from the edges count.
inline ExactSurface exactBoxFaces(const V3d& size, double margin) {
  const V3d half = size / 2;
  const auto beyond = [=](const V3d& p) {  // distance outside each pair of faces
    return V3d(std::abs(p.x), std::abs(p.y), std::abs(p.z)) - half;
  };
  ExactSurface box{[=](const V3d& p) {
                     V3d d = beyond(p);
                     if (d.y > d.x) std::swap(d.x, d.y);
                     if (d.z > d.x) std::swap(d.x, d.z);
                     if (std::max(d.y, d.z) > -margin) return 0.0;  // near an edge
                     return d.x;
                   },
                   {}};
  constexpr int kSteps = 100;
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i <= kSteps; ++i)
      for (int j = 0; j <= kSteps; ++j) {
        V3d p;
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        p[axis] = half[axis];
        p[u] = (2.0 * i / kSteps - 1) * (half[u] - margin);
        p[v] = (2.0 * j / kSteps - 1) * (half[v] - margin);
        box.points.push_back(p);
        box.points.push_back(-p);
      }
  return box;
}

/// Two-sided Hausdorff distance, with 6² samples on each triangle.
inline double trueError(const levelset::TriMesh& result, const ExactSurface& exact) {
  double worst = 0;
  for (const auto& [a, b, c] : result.triangles)
    for (int i = 0; i <= 6; ++i)
      for (int j = 0; i + j <= 6; ++j) {
        const V3d p = result.positions[a] +
                      (result.positions[b] - result.positions[a]) * (i / 6.0) +
                      (result.positions[c] - result.positions[a]) * (j / 6.0);
        worst = std::max(worst, std::abs(exact.distance(p)));
      }
  const levelset::TriangleSurface surface(result);
  for (const V3d& p : exact.points) worst = std::max(worst, surface.distance(p, 1e100));
  return worst;
}

}  // namespace support
