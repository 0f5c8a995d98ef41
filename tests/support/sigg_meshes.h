#pragma once

// The closed surfaces on which Sigg measured his prisms, and random fans of triangles.

#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "tests/support/meshes.h"

namespace support {

/// Octahedron on the unit sphere, each triangle split into four `levels` times: 8 · 4^levels
/// triangles. Six levels give the 16,386 vertices of "sphere6".
inline TriMesh subdividedSphere(int levels) {
  TriMesh mesh;
  mesh.positions = {V3d(1, 0, 0),  V3d(-1, 0, 0), V3d(0, 1, 0),
                    V3d(0, -1, 0), V3d(0, 0, 1),  V3d(0, 0, -1)};
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                    {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [entry, isNew] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.positions.size()));
      if (isNew) mesh.positions.push_back((mesh.positions[a] + mesh.positions[b]).normalized());
      return entry->second;
    };
    std::vector<std::array<std::uint32_t, 3>> split;
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      split.insert(split.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(split);
  }
  return mesh;
}

/// Tube of constant radius around the trefoil knot, without twist of the mesh against the curve.
inline TriMesh trefoilTube(double tube, unsigned along, unsigned around) {
  const auto curve = [](double t) {
    return V3d(std::sin(t) + 2 * std::sin(2 * t), std::cos(t) - 2 * std::cos(2 * t),
               -std::sin(3 * t));
  };
  return patchMesh(along, around, true, true, [&](double u, double v) {
    const double t = 2 * std::numbers::pi * u, a = 2 * std::numbers::pi * v, h = 1e-4;
    const V3d tangent = (curve(t + h) - curve(t - h)).normalized();
    const V3d bend = curve(t + h) - curve(t) * 2 + curve(t - h);
    const V3d normal = (bend - tangent * tangent.dot(bend)).normalized();
    const V3d side = tangent.cross(normal);
    return curve(t) + (normal * std::cos(a) - side * std::sin(a)) * tube;
  });
}

/// Sea shell: a tube around a spiral that grows towards its mouth. A fan closes each end: a disc at
/// the mouth and a cone at the tip. It has `along` × `around` vertices, two of them in the fans'
/// centres when `around` does not divide them.
inline TriMesh seaShell(unsigned along, unsigned around, double turns = 3) {
  TriMesh mesh = patchMesh(along, around, false, true, [&](double u, double v) {
    const double t = 2 * std::numbers::pi * turns * u, a = 2 * std::numbers::pi * v;
    const double size = std::exp(0.12 * (t - 2 * std::numbers::pi * turns));
    const V3d out(std::cos(t), std::sin(t), 0);
    return (out * (1 + 0.55 * std::cos(a)) + V3d(0, 0, 0.55 * std::sin(a) - 1.6)) * size;
  });
  const auto close = [&](std::uint32_t first, bool isStart) {
    V3d centre(0);
    for (unsigned j = 0; j < around; ++j) centre += mesh.positions[first + j];
    const auto at = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back(centre / around);
    for (unsigned j = 0; j < around; ++j) {
      const std::uint32_t a = first + j, b = first + (j + 1) % around;
      mesh.triangles.push_back(isStart ? std::array{at, a, b} : std::array{at, b, a});
    }
  };
  close(0, true);
  close((along - 1) * around, false);
  return levelset::signedVolume(mesh) < 0 ? reversed(mesh) : mesh;
}

/// Closed fan of triangles around the origin: star-shaped about the z axis, all faces towards +z.
/// Returns the neighbours of the vertex at the origin in order.
inline std::vector<V3d> randomFan(std::mt19937& random, unsigned valence) {
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<V3d> ring;
  for (unsigned i = 0; i < valence; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.1 + 0.8 * unit(random)) / valence;
    const double radius = 0.5 + unit(random);
    ring.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 1.6 * unit(random) - 0.8);
  }
  return ring;
}

}  // namespace support
