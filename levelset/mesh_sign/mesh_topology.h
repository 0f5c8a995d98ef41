#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "levelset/mesh.h"

namespace levelset::convert {

using Triangle = std::array<std::uint32_t, 3>;

/// A directed edge that more faces traverse from `from` to `to` than in the opposite direction.
struct BoundaryEdge {
  std::uint32_t from = 0, to = 0;
  int multiplicity = 1;  ///< faces in this direction minus faces in the other, positive
};

struct MeshTopology {
  /// Faces over welded vertices. Among vertices at equal positions, the one with the lowest index
  /// represents the others. Faces with a repeated vertex are removed. Exact duplicates of a face
  /// are removed unless that opens the mesh. A face and its reverse both stay.
  std::vector<Triangle> triangles;
  std::size_t dropped = 0;           ///< number of faces that were removed
  std::size_t boundaryEdges = 0;     ///< edges with one face
  std::size_t nonManifoldEdges = 0;  ///< edges with three or more faces
  std::size_t oddEdges = 0;  ///< edges with an odd number of faces, where crossing parity fails
  std::vector<BoundaryEdge> boundary;  ///< edges that more faces traverse in one direction than in
                                       ///< the other
  [[nodiscard]] bool isClosed() const { return boundaryEdges == 0 && nonManifoldEdges == 0; }
};

/// Finds the welded faces and counts their edges by the number of faces.
/// @pre every index < positions.size()
[[nodiscard]] MeshTopology findTopology(const TriMesh& mesh);

}  // namespace levelset::convert
