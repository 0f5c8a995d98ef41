#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

#include "levelset/geometry/disjoint_sets.h"

/// Sides of the triangles of a mesh, and the patches that they connect. Internal.
namespace levelset {

/// Side of a triangle: an edge of the mesh, as the triangle runs along it.
struct MeshSide {
  std::uint32_t low, high, triangle;
  std::uint8_t corner;  ///< of the triangle, where the side begins
  bool rises;           ///< runs from `low` to `high`

  [[nodiscard]] bool isBeside(const MeshSide& other) const {
    return low == other.low && high == other.high;
  }
};

/// Returns the sides of all triangles. Those of an edge follow each other, by triangle.
[[nodiscard]] inline std::vector<MeshSide> sortedSides(
    const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  std::vector<MeshSide> sides;
  sides.reserve(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (std::uint8_t k = 0; k < 3; ++k) {
      const std::uint32_t from = triangles[t][k], to = triangles[t][(k + 1u) % 3];
      sides.push_back({std::min(from, to), std::max(from, to), t, k, from < to});
    }
  std::sort(sides.begin(), sides.end(), [](const MeshSide& a, const MeshSide& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  return sides;
}

/// Calls `visit` with the range of the sides of each edge.
template <class Visit>
void forEachEdge(const std::vector<MeshSide>& sides, const Visit& visit) {
  for (auto first = sides.begin(), end = first; first != sides.end(); first = end) {
    while (end != sides.end() && end->isBeside(*first)) ++end;
    visit(first, end);
  }
}

/// Connects the triangles that share an edge with one other triangle, which runs along it in the
/// opposite direction.
/// @param belongs  decides if a triangle may be connected with others
template <class Belongs>
[[nodiscard]] DisjointSets connectedPatches(
    const std::vector<std::array<std::uint32_t, 3>>& triangles, const Belongs& belongs) {
  DisjointSets patches(triangles.size());
  const std::vector<MeshSide> sides = sortedSides(triangles);
  forEachEdge(sides, [&](auto first, auto end) {
    if (end - first != 2) return;
    const MeshSide &a = first[0], &b = first[1];
    if (a.rises != b.rises && belongs(a.triangle) && belongs(b.triangle))
      patches.join(a.triangle, b.triangle);
  });
  return patches;
}

}  // namespace levelset
