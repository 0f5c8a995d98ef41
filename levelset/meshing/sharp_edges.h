#pragma once

// Mesh edges with the triangles on both sides, and flips of them. Includes OpenVDB: for .cpp files
// only.

#include <unordered_set>

#include "levelset/meshing/sharp_features.h"

namespace levelset {

using MeshTriangle = std::array<std::uint32_t, 3>;

/// A mesh edge and the triangles on both sides of it.
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

/// Both triangles beside an edge, once it joins the two vertices opposite to it.
struct EdgeFlip {
  MeshTriangle left, right;
  std::uint64_t removed = 0, added = 0;  ///< edgeKey
  bool isPossible = false;
};

[[nodiscard]] std::uint64_t edgeKey(std::uint32_t a, std::uint32_t b);
/// The vertices of the chosen triangles. What scans a whole mesh looks here first: few are.
[[nodiscard]] std::vector<bool> markVertices(const std::vector<MeshTriangle>& triangles,
                                             const std::vector<std::size_t>& chosen,
                                             std::size_t vertexCount);
/// Adds the sides of the chosen triangles, as both triangles beside them have them.
void addSides(const std::vector<MeshTriangle>& triangles, const std::vector<std::size_t>& chosen,
              std::size_t vertexCount, std::vector<TriangleSide>& sides);
/// Edges of a closed mesh from their sides, each edge's both sides among these, in rising order.
[[nodiscard]] std::vector<PairedEdge> pairSides(std::vector<TriangleSide> sides);
/// All mesh edges between vertices that a flip of one of the edges could join.
[[nodiscard]] std::unordered_set<std::uint64_t> edgesBeside(
    const std::vector<PairedEdge>& edges, const std::vector<MeshTriangle>& triangles,
    std::size_t vertexCount);
/// @param present  the mesh's edges beside; a flip must not make one of them again
[[nodiscard]] EdgeFlip flipOf(const PairedEdge& edge, const std::vector<MeshTriangle>& triangles,
                              const std::unordered_set<std::uint64_t>& present);
void applyFlip(const EdgeFlip& flip, const PairedEdge& edge, std::vector<MeshTriangle>& triangles,
               std::unordered_set<std::uint64_t>& present);

}  // namespace levelset
