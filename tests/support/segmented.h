#pragma once

// Checks of meshes of segmented fields, and solids that partition a ball, for tests.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include "levelset/segmented/meshing/segmented_to_mesh.h"
#include "tests/support/bands.h"
#include "tests/support/meshes.h"

namespace support {

/// Defects of a mesh of interfaces; all zero for a proper one.
struct InterfaceDefects {
  std::size_t openEdges =
      0;  ///< edges of the surface of a region that are not traversed equally in both ways
  std::size_t duplicates = 0;      ///< triangles with the same three vertices
  std::size_t collapsed = 0;       ///< triangles with a vertex twice
  std::size_t misnamed = 0;        ///< triangles whose labels are equal or in the wrong order
  std::size_t looseJunctions = 0;  ///< edges with three triangles or more that are no junction
  std::size_t unused = 0;          ///< vertices

  friend bool operator==(const InterfaceDefects&, const InterfaceDefects&) = default;
};

inline InterfaceDefects interfaceDefects(const levelset::SegmentedMesh& mesh) {
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  struct Side {
    levelset::RegionLabel region;
    Edge edge;
    int step;
  };
  InterfaceDefects defects;
  std::vector<Side> sides;
  std::vector<Edge> edges;
  std::vector<std::array<std::uint32_t, 3>> triangles = mesh.mesh.triangles;
  std::vector<bool> isUsed(mesh.mesh.positions.size());
  for (std::size_t t = 0; t < mesh.sides.size(); ++t) {
    const auto [behind, front] = mesh.sides[t];
    defects.misnamed += front >= behind;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles[t][k], b = triangles[t][(k + 1) % 3];
      isUsed[a] = true;
      defects.collapsed += a == b;
      const Edge edge = std::minmax(a, b);
      const int step = a < b ? 1 : -1;
      sides.push_back({behind, edge, step});
      sides.push_back({front, edge, -step});
      edges.push_back(edge);
    }
    std::sort(triangles[t].begin(), triangles[t].end());
  }
  std::sort(triangles.begin(), triangles.end());
  for (std::size_t t = 1; t < triangles.size(); ++t)
    defects.duplicates += triangles[t] == triangles[t - 1];

  const auto keyOf = [](const Side& side) { return std::pair(side.region, side.edge); };
  std::sort(sides.begin(), sides.end(),
            [&](const Side& a, const Side& b) { return keyOf(a) < keyOf(b); });
  for (std::size_t first = 0, last = 0; first < sides.size(); first = last) {
    int balance = 0;
    while (last < sides.size() && keyOf(sides[last]) == keyOf(sides[first]))
      balance += sides[last++].step;
    defects.openEdges += balance != 0;
  }

  std::vector<Edge> junctions;
  for (const levelset::JunctionEdge& junction : mesh.junctions)
    junctions.push_back(std::minmax(junction.vertices[0], junction.vertices[1]));
  std::sort(junctions.begin(), junctions.end());
  std::sort(edges.begin(), edges.end());
  for (std::size_t first = 0, last = 0; first < edges.size(); first = last) {
    while (last < edges.size() && edges[last] == edges[first]) ++last;
    defects.looseJunctions +=
        (last - first > 2) != std::binary_search(junctions.begin(), junctions.end(), edges[first]);
  }
  defects.unused = static_cast<std::size_t>(std::count(isUsed.begin(), isUsed.end(), false));
  return defects;
}

/// Turned frame of a partition.
struct Frame {
  V3d centre, x, y, z;
};
inline Frame turnedFrame(const V3d& centre, double angle) {
  return {centre, turned(V3d(1, 0, 0), angle), turned(V3d(0, 1, 0), angle),
          turned(V3d(0, 0, 1), angle)};
}

/// Distance from a sector of 120° about the z axis of a frame, exact.
/// @param k  number of the sector, 0 to 2
inline double sectorDistance(const Frame& frame, int k, const V3d& world) {
  const V3d p = world - frame.centre;
  const double angle = 2 * std::numbers::pi / 3 * k, x = p.dot(frame.x), y = p.dot(frame.y),
               u = x * std::cos(angle) + y * std::sin(angle),
               v = std::abs(y * std::cos(angle) - x * std::sin(angle)), root = std::sqrt(0.75);
  return 0.5 * u + root * v > 0 ? 0.5 * v - root * u : std::hypot(u, v);
}

/// Ball cut into three sectors of 120°.
inline std::vector<levelset::NarrowBand> ballSectors(const Frame& frame, double radius,
                                                     double voxel) {
  std::vector<levelset::NarrowBand> solids;
  for (int k = 0; k < 3; ++k)
    solids.push_back(sampleBand(
        [&](const V3d& p) {
          return std::max(sectorDistance(frame, k, p), (p - frame.centre).length() - radius);
        },
        {frame.centre - V3d(radius), frame.centre + V3d(radius)}, voxel));
  return solids;
}

}  // namespace support
