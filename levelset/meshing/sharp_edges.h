#pragma once

// Mesh edges with the triangles on both sides, and flips of these edges. Internal header of
// levelset: public headers must not include it.

#include <unordered_set>

#include "levelset/meshing/sharp_features.h"

namespace levelset {

using MeshTriangle = std::array<std::uint32_t, 3>;

/// Mesh edge and the triangles on both sides of it.
struct PairedEdge {
  std::uint32_t low, high;
  std::array<std::size_t, 2> triangle;
  double weight = 0;
  bool done = false;
};

/// One side of a triangle.
struct TriangleSide {
  std::uint32_t low, high;
  std::size_t triangle;
};

/// Both triangles beside an edge after it is flipped to join the two opposite vertices.
struct EdgeFlip {
  MeshTriangle left, right;
  std::uint64_t removed = 0, added = 0;  ///< edgeKey of the removed and of the added edge
  bool isPossible = false;
};

[[nodiscard]] std::uint64_t edgeKey(std::uint32_t a, std::uint32_t b);
/// Marks the vertices of the chosen triangles. Scans of an entire mesh test this first, since few
/// vertices are marked.
[[nodiscard]] std::vector<bool> markVertices(const std::vector<MeshTriangle>& triangles,
                                             const std::vector<std::size_t>& chosen,
                                             std::size_t vertexCount);
/// Adds the sides of the chosen triangles, once for each of the two triangles beside them.
void addSides(const std::vector<MeshTriangle>& triangles, const std::vector<std::size_t>& chosen,
              std::size_t vertexCount, std::vector<TriangleSide>& sides);
/// Pairs the sides of a closed mesh into edges, in rising order. Both sides of each edge must be in
/// `sides`.
[[nodiscard]] std::vector<PairedEdge> pairSides(std::vector<TriangleSide> sides);
/// Returns all mesh edges between vertices that a flip of one of the edges could join.
[[nodiscard]] std::unordered_set<std::uint64_t> edgesBeside(
    const std::vector<PairedEdge>& edges, const std::vector<MeshTriangle>& triangles,
    std::size_t vertexCount);
/// Computes the flip of an edge.
/// @param present  edges of the mesh beside it; a flip must not create one of them again
[[nodiscard]] EdgeFlip flipOf(const PairedEdge& edge, const std::vector<MeshTriangle>& triangles,
                              const std::unordered_set<std::uint64_t>& present);
void applyFlip(const EdgeFlip& flip, const PairedEdge& edge, std::vector<MeshTriangle>& triangles,
               std::unordered_set<std::uint64_t>& present);

}  // namespace levelset
