#pragma once

// Mesh edges with the triangles on both sides, and flips of these edges. Internal header of
// levelset: public headers must not include it.

#include <unordered_set>

#include "levelset/meshing/sharp/sharp_features.h"

namespace levelset {

using MeshTriangle = std::array<std::uint32_t, 3>;

/// Mesh edge between the vertices `low` < `high`, and the indices of the triangles on both sides.
struct PairedEdge {
  std::uint32_t low, high;
  std::array<std::size_t, 2> triangle;
  double weight = 0;  ///< priority: edges of larger weight are processed first
  bool done = false;  ///< true after the edge was flipped
};

/// One side of a triangle: an edge between the vertices `low` < `high`.
struct TriangleSide {
  std::uint32_t low, high;
  std::size_t triangle;
};

/// The two triangles that a flip of an edge yields. The new edge joins the vertices opposite to the
/// old one.
struct EdgeFlip {
  MeshTriangle left, right;
  std::uint64_t removed = 0, added = 0;  ///< edgeKey of the removed and of the added edge
  bool isPossible = false;
};

/// Number that identifies the edge between two vertices, in either order.
[[nodiscard]] std::uint64_t edgeKey(std::uint32_t a, std::uint32_t b);
/// Returns a flag for each vertex: true for the vertices of the triangles with the indices
/// `chosen`. Loops over an entire mesh test these flags first, since few of them are true.
[[nodiscard]] std::vector<bool> markVertices(const std::vector<MeshTriangle>& triangles,
                                             const std::vector<std::size_t>& chosen,
                                             std::size_t vertexCount);
/// Adds each edge of the chosen triangles to `sides`, once for each of the two triangles beside it.
void addSides(const std::vector<MeshTriangle>& triangles, const std::vector<std::size_t>& chosen,
              std::size_t vertexCount, std::vector<TriangleSide>& sides);
/// Pairs triangle sides into edges, ordered by vertex indices. `sides` must contain each edge once
/// for each of the one or two triangles beside it; repeats are ignored. Edges at the border of the
/// mesh, with one triangle, yield no pair.
[[nodiscard]] std::vector<PairedEdge> pairSides(std::vector<TriangleSide> sides);
/// Returns the keys of all mesh edges between vertices that a flip of one of `edges` could join.
[[nodiscard]] std::unordered_set<std::uint64_t> edgesBeside(
    const std::vector<PairedEdge>& edges, const std::vector<MeshTriangle>& triangles,
    std::size_t vertexCount);
/// Computes the flip of an edge.
/// @param present  keys from edgesBeside(). The flip is impossible if the mesh already has the new
///         edge.
[[nodiscard]] EdgeFlip flipOf(const PairedEdge& edge, const std::vector<MeshTriangle>& triangles,
                              const std::unordered_set<std::uint64_t>& present);
void applyFlip(const EdgeFlip& flip, const PairedEdge& edge, std::vector<MeshTriangle>& triangles,
               std::unordered_set<std::uint64_t>& present);

}  // namespace levelset
