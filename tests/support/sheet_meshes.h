#pragma once

// Meshes with borders, junctions and self-intersections, and checks of their segmentations.

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "levelset/segmented/meshing/segmented_to_mesh.h"
#include "tests/support/meshes.h"
#include "tests/support/segmented.h"

namespace support {

/// Flat ring in the plane z = 0 of a frame; a disk for the inner radius 0.
inline TriMesh ringMesh(double inner, double outer, const Frame& frame, unsigned sides = 96) {
  const auto place = [&](double r, double a) {
    return frame.centre + frame.x * (r * std::cos(a)) + frame.y * (r * std::sin(a));
  };
  constexpr unsigned kRings = 4;
  TriMesh mesh = patchMesh(sides, kRings, true, false, [&](double u, double v) {
    return place(inner + (outer - inner) * (inner > 0 ? v : 0.25 + 0.75 * v),
                 2 * std::numbers::pi * u);
  });
  if (inner > 0) return mesh;
  const auto middle = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.push_back(frame.centre);
  for (unsigned j = 0; j < sides; ++j)
    mesh.triangles.push_back({middle, j * kRings, (j + 1) % sides * kRings});
  return mesh;
}

/// Frame tilted about the y axis.
inline Frame tiltedFrame(const V3d& centre, double degrees) {
  const double a = degrees * std::numbers::pi / 180;
  return {centre, V3d(std::cos(a), 0, -std::sin(a)), V3d(0, 1, 0),
          V3d(std::sin(a), 0, std::cos(a))};
}

/// Point of a Möbius strip of radius 1 about the z axis.
/// @param u  around it, 0 to 1
/// @param v  across it, −1 to 1
inline V3d moebiusPoint(double width, double u, double v) {
  const double a = 2 * std::numbers::pi * u, r = 1 + width / 2 * v * std::cos(a / 2);
  return {r * std::cos(a), r * std::sin(a), width / 2 * v * std::sin(a / 2)};
}
inline TriMesh moebiusMesh(double width, const Frame& frame, unsigned around = 96,
                           unsigned across = 9) {
  TriMesh mesh = patchMesh(around + 1, across, false, false, [&](double u, double v) {
    const V3d p = moebiusPoint(width, u, 2 * v - 1);
    return frame.centre + frame.x * p.x + frame.y * p.y + frame.z * p.z;
  });
  // The last row is the first one, upside down.
  mesh.positions.resize(std::size_t{around} * across);
  for (auto& t : mesh.triangles)
    for (std::uint32_t& v : t)
      if (v >= around * across) v = across - 1 - (v - around * across);
  return mesh;
}

/// Klein bottle: a figure of eight that turns by half while it goes around the z axis. It crosses
/// itself in the circle of radius 1. Inside are both lobes, which are connected.
inline TriMesh kleinMesh(double lobe, const Frame& frame, unsigned around = 96,
                         unsigned across = 48) {
  TriMesh mesh = patchMesh(around + 1, across, false, true, [&](double u, double v) {
    const double a = 2 * std::numbers::pi * u, b = 2 * std::numbers::pi * (v + 0.5 / across);
    const double p = lobe * std::sin(b), q = lobe * std::sin(2 * b) / 2;
    const double r = 1 + p * std::cos(a / 2) - q * std::sin(a / 2),
                 z = p * std::sin(a / 2) + q * std::cos(a / 2);
    return frame.centre + frame.x * (r * std::cos(a)) + frame.y * (r * std::sin(a)) + frame.z * z;
  });
  // After one turn the figure is upside down: b becomes −b.
  mesh.positions.resize(std::size_t{around} * across);
  for (auto& t : mesh.triangles)
    for (std::uint32_t& v : t)
      if (v >= around * across) v = across - 1 - (v - around * across);
  return mesh;
}

/// Pages around the z axis of a frame, at angles in degrees. They share the vertices of the spine.
inline TriMesh bookMesh(const std::vector<double>& degrees, double width, double length,
                        const Frame& frame, unsigned steps = 8) {
  TriMesh mesh;
  const auto at = [&](double r, double a, unsigned k) {
    return frame.centre + frame.x * (r * std::cos(a)) + frame.y * (r * std::sin(a)) +
           frame.z * (length * (double(k) / steps - 0.5));
  };
  for (unsigned k = 0; k <= steps; ++k) mesh.positions.push_back(at(0, 0, k));
  for (const double degree : degrees) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (unsigned k = 0; k <= steps; ++k)
      mesh.positions.push_back(at(width, degree * std::numbers::pi / 180, k));
    for (std::uint32_t k = 0; k < steps; ++k) {
      mesh.triangles.push_back({k, first + k, first + k + 1});
      mesh.triangles.push_back({k, first + k + 1, k + 1});
    }
  }
  return mesh;
}

/// Sphere with a diaphragm in its equator that has a round hole.
inline TriMesh sphereWithHoledDiaphragm(const V3d& centre, double hole, unsigned rings) {
  const unsigned sides = 2 * rings;
  TriMesh mesh = sphereMesh(1, centre, rings);
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (unsigned j = 0; j < sides; ++j)
    mesh.positions.push_back(centre + V3d(std::cos(2 * std::numbers::pi * j / sides),
                                          std::sin(2 * std::numbers::pi * j / sides), 0) *
                                          hole);
  for (unsigned j = 0; j < sides; ++j) {
    const std::uint32_t a = 1 + (rings / 2 - 1) * sides + j,
                        b = 1 + (rings / 2 - 1) * sides + (j + 1) % sides, c = first + j,
                        d = first + (j + 1) % sides;
    mesh.triangles.push_back({a, b, d});
    mesh.triangles.push_back({a, d, c});
  }
  return mesh;
}

/// Adds a flat ring around the equator of a sphere, from radius 1 to `outer`. It shares the
/// vertices of the equator. @param mesh  begins with sphereMesh(1, centre, rings)
inline void addEquatorRing(TriMesh& mesh, const V3d& centre, double outer, unsigned rings) {
  const unsigned sides = 2 * rings, equator = 1 + (rings / 2 - 1) * sides;
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (unsigned j = 0; j < sides; ++j) {
    const double a = 2 * std::numbers::pi * j / sides;
    mesh.positions.push_back(centre + V3d(std::cos(a), std::sin(a), 0) * outer);
  }
  for (unsigned j = 0; j < sides; ++j) {
    const unsigned next = (j + 1) % sides;
    mesh.triangles.push_back({equator + j, first + j, first + next});
    mesh.triangles.push_back({equator + j, first + next, equator + next});
  }
}

/// Box from 0 to (3, 2, 2) with a wall at x = 1 that has a door from the floor.
inline TriMesh boxWithDoor(const V3d& origin) {
  TriMesh mesh;
  const auto add = [&](double x, double y, double z) {
    mesh.positions.push_back(origin + V3d(x, y, z));
    return static_cast<std::uint32_t>(mesh.positions.size() - 1);
  };
  // Lines of the grid of faces: the outer walls are divided where the inner one meets them.
  const std::vector<double> xs = {0, 1, 3}, ys = {0, 0.7, 1.3, 2}, zs = {0, 1.4, 2};
  const auto addFace = [&](int axis, double height, const std::vector<double>& us,
                           const std::vector<double>& vs, bool hasDoor) {
    for (std::size_t i = 0; i + 1 < us.size(); ++i)
      for (std::size_t j = 0; j + 1 < vs.size(); ++j) {
        if (hasDoor && i == 1 && j == 0) continue;
        const auto corner = [&](std::size_t u, std::size_t v) {
          std::array<double, 3> p{};
          p[static_cast<std::size_t>(axis)] = height;
          p[static_cast<std::size_t>((axis + 1) % 3)] = us[u];
          p[static_cast<std::size_t>((axis + 2) % 3)] = vs[v];
          return add(p[0], p[1], p[2]);
        };
        const std::uint32_t a = corner(i, j), b = corner(i + 1, j), c = corner(i + 1, j + 1),
                            d = corner(i, j + 1);
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({a, c, d});
      }
  };
  for (const double x : {0.0, 3.0}) addFace(0, x, ys, zs, false);
  for (const double y : {0.0, 2.0}) addFace(1, y, zs, xs, false);
  for (const double z : {0.0, 2.0}) addFace(2, z, xs, ys, false);
  addFace(0, 1, ys, zs, true);
  return mesh;
}

/// Shape of the sheets of a mesh, found from its triangles only.
struct SheetShape {
  std::size_t borderEdges = 0;  ///< edges with one triangle
  std::size_t rimLoops = 0;     ///< closed curves of them
  std::size_t tornRims = 0;     ///< vertices with an odd number of them
  std::size_t components = 0;
  std::size_t wrongRims = 0;  ///< edges that are a border or in the list of rims, but not both
  long euler = 0;             ///< V − E + F of the whole mesh
  bool isOrientable = true;   ///< across edges of two triangles
};

inline SheetShape sheetShape(const levelset::SegmentedMesh& mesh) {
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  struct Use {
    std::uint32_t triangle;
    bool rises;
  };
  std::map<Edge, std::vector<Use>> edges;
  const auto& triangles = mesh.mesh.triangles;
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles[t][k], b = triangles[t][(k + 1) % 3];
      edges[std::minmax(a, b)].push_back({t, a < b});
    }
  SheetShape shape;
  shape.euler = static_cast<long>(mesh.mesh.positions.size()) - static_cast<long>(edges.size()) +
                static_cast<long>(triangles.size());
  // Double cover of the triangles: side 2t or 2t + 1.
  std::vector<std::uint32_t> parent(2 * triangles.size());
  for (std::uint32_t n = 0; n < parent.size(); ++n) parent[n] = n;
  const auto find = [&](std::uint32_t n) {
    while (parent[n] != n) n = parent[n] = parent[parent[n]];
    return n;
  };
  std::map<std::uint32_t, std::vector<std::uint32_t>> rim;
  std::set<Edge> known;
  for (const auto& [a, b] : mesh.rims) known.insert(std::minmax(a, b));
  std::size_t hits = 0;
  for (const auto& [edge, uses] : edges) {
    if (uses.size() == 1) {
      ++shape.borderEdges;
      hits += known.count(edge);
      rim[edge.first].push_back(edge.second);
      rim[edge.second].push_back(edge.first);
    }
    if (uses.size() != 2) continue;
    const std::uint32_t turn = uses[0].rises == uses[1].rises;
    for (std::uint32_t side = 0; side < 2; ++side)
      parent[find(2 * uses[0].triangle + side)] = find(2 * uses[1].triangle + (side ^ turn));
  }
  shape.wrongRims = shape.borderEdges - hits + known.size() - hits;
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    if (find(2 * t) == find(2 * t + 1)) shape.isOrientable = false;
  std::set<std::uint32_t> seen;
  for (const auto& [start, around] : rim) {
    shape.tornRims += around.size() % 2;
    if (seen.count(start)) continue;
    ++shape.rimLoops;
    std::vector<std::uint32_t> stack = {start};
    while (!stack.empty()) {
      const std::uint32_t v = stack.back();
      stack.pop_back();
      if (!seen.insert(v).second) continue;
      for (const std::uint32_t next : rim[v]) stack.push_back(next);
    }
  }
  // Components of vertices.
  std::vector<std::uint32_t> joined(mesh.mesh.positions.size());
  for (std::uint32_t n = 0; n < joined.size(); ++n) joined[n] = n;
  const auto root = [&](std::uint32_t n) {
    while (joined[n] != n) n = joined[n] = joined[joined[n]];
    return n;
  };
  for (const auto& [edge, uses] : edges) joined[root(edge.first)] = root(edge.second);
  for (std::uint32_t n = 0; n < joined.size(); ++n) shape.components += root(n) == n;
  return shape;
}

}  // namespace support
