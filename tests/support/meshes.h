#pragma once

// Meshes from formulas, and exact answers about them by brute force, for tests.

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "levelset/mesh.h"

namespace support {

using Imath::V3d;
using levelset::TriMesh;

/// An (m × n) grid of vertices, split into triangles and closed in u or v on request.
inline TriMesh patchMesh(unsigned m, unsigned n, bool closedU, bool closedV,
                         const std::function<V3d(double u, double v)>& place) {
  TriMesh mesh;
  for (unsigned i = 0; i < m; ++i)
    for (unsigned j = 0; j < n; ++j)
      mesh.positions.push_back(
          place(double(i) / (closedU ? m : m - 1), double(j) / (closedV ? n : n - 1)));
  const auto at = [&](unsigned i, unsigned j) { return (i % m) * n + j % n; };
  for (unsigned i = 0; i + !closedU < m; ++i)
    for (unsigned j = 0; j + !closedV < n; ++j) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

/// Torus around the z axis, facing outwards.
inline TriMesh torusMesh(double radius, double tube, unsigned m = 64, unsigned n = 32,
                         V3d centre = V3d(0)) {
  return patchMesh(m, n, true, true, [=](double u, double v) {
    const double a = 2 * std::numbers::pi * u, b = 2 * std::numbers::pi * v;
    const double r = radius + tube * std::cos(b);
    return centre + V3d(r * std::cos(a), r * std::sin(a), tube * std::sin(b));
  });
}

/// Part of a sphere from the south pole up to `latitude` (1: complete sphere), facing outwards.
/// Each pole is a single vertex.
inline TriMesh sphereMesh(double radius, V3d centre = V3d(0), unsigned rings = 24,
                          double latitude = 1) {
  TriMesh mesh;
  const unsigned sides = 2 * rings;
  const bool whole = latitude >= 1;
  mesh.positions.push_back(centre - V3d(0, 0, radius));
  const unsigned last = whole ? rings - 1 : rings;
  for (unsigned i = 1; i <= last; ++i)
    for (unsigned j = 0; j < sides; ++j) {
      const double polar = std::numbers::pi * latitude * i / rings,
                   a = 2 * std::numbers::pi * j / sides;
      mesh.positions.push_back(centre + V3d(std::sin(polar) * std::cos(a),
                                            std::sin(polar) * std::sin(a), -std::cos(polar)) *
                                            radius);
    }
  const auto at = [&](unsigned i, unsigned j) { return 1 + (i - 1) * sides + j % sides; };
  for (unsigned j = 0; j < sides; ++j) mesh.triangles.push_back({0, at(1, j + 1), at(1, j)});
  for (unsigned i = 1; i < last; ++i)
    for (unsigned j = 0; j < sides; ++j) {
      mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
  if (whole) {
    const auto top = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back(centre + V3d(0, 0, radius));
    for (unsigned j = 0; j < sides; ++j)
      mesh.triangles.push_back({top, at(last, j), at(last, j + 1)});
  }
  return mesh;
}

inline TriMesh boxMesh(const V3d& low, const V3d& high) {
  TriMesh mesh;
  for (unsigned i = 0; i < 8; ++i)
    mesh.positions.emplace_back(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y,
                                i & 4 ? high.z : low.z);
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

inline TriMesh transformed(TriMesh mesh, const std::function<V3d(const V3d&)>& map) {
  for (V3d& p : mesh.positions) p = map(p);
  return mesh;
}

/// Rotation about the axis (1, 1, 1).
inline V3d turned(const V3d& p, double angle) {
  const V3d axis = V3d(1, 1, 1).normalized();
  return p * std::cos(angle) + axis.cross(p) * std::sin(angle) +
         axis * (axis.dot(p) * (1 - std::cos(angle)));
}

inline TriMesh reversed(TriMesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

inline TriMesh joined(TriMesh a, const TriMesh& b) {
  const auto offset = static_cast<std::uint32_t>(a.positions.size());
  a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
  for (auto t : b.triangles) a.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  return a;
}

/// Gives each triangle its own vertices, moved by up to `jitter`. No two triangles share an edge.
inline TriMesh soup(const TriMesh& mesh, double jitter = 0) {
  TriMesh result;
  std::uint64_t state = 1;
  const auto noise = [&] {
    state = state * 6364136223846793005ull + 1442695040888963407ull;
    return (double(state >> 40) / double(1 << 24) - 0.5) * 2 * jitter;
  };
  for (const auto& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(result.positions.size());
    for (const auto v : t)
      result.positions.push_back(mesh.positions[v] + V3d(noise(), noise(), noise()));
    result.triangles.push_back({first, first + 1, first + 2});
  }
  return result;
}

/// Closest point of a triangle, by the regions of its plane (Ericson, Real-Time Collision
/// Detection, section 5.1.5).
inline V3d closestPoint(const V3d& a, const V3d& b, const V3d& c, const V3d& p) {
  const V3d ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const V3d bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / (d1 - d3));
  const V3d cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
    return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  const double sum = 1 / (va + vb + vc);
  return a + ab * (vb * sum) + ac * (vc * sum);
}

inline double unsignedDistance(const TriMesh& mesh, const V3d& p) {
  double best = std::numeric_limits<double>::infinity();
  for (const auto& t : mesh.triangles)
    best = std::min(
        best,
        (closestPoint(mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]], p) - p)
            .length2());
  return std::sqrt(best);
}

}  // namespace support
