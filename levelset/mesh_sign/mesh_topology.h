#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "levelset/mesh.h"

namespace levelset::convert {

using Triangle = std::array<std::uint32_t, 3>;

/// A directed edge of the mesh's boundary, counted as often as the faces leave it unmatched.
struct BoundaryEdge {
  std::uint32_t from = 0, to = 0;
  int multiplicity = 1;  ///< positive
};

struct MeshTopology {
  /// Faces over welded vertices: of vertices at equal positions, the one with the lowest index.
  /// Faces with a repeated vertex are left out, and exact repetitions of a face unless that opens
  /// the mesh; a face and its reverse stay.
  std::vector<Triangle> triangles;
  std::size_t dropped = 0;
  std::size_t boundaryEdges = 0;       ///< with one face
  std::size_t nonManifoldEdges = 0;    ///< with three or more faces
  std::size_t oddEdges = 0;            ///< with an odd number of faces: crossing parity fails there
  std::vector<BoundaryEdge> boundary;  ///< edges that more faces run along one way than the other
  [[nodiscard]] bool isClosed() const { return boundaryEdges == 0 && nonManifoldEdges == 0; }
};

/// @pre every index < positions.size()
[[nodiscard]] MeshTopology findTopology(const TriMesh& mesh);

}  // namespace levelset::convert
