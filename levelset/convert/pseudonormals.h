#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/mesh_sign/local_mesh.h"

namespace levelset::convert {

/// An edge at which the faces do not form a consistently oriented surface.
struct UnorientedEdge {
  Imath::V3d from, to;    ///< end points, in the frame of the LocalMesh
  std::size_t faces = 0;  ///< number of faces that share the edge
};

/// Normals at the faces, edges and vertices of a mesh. A point lies in front of the surface if and
/// only if it lies in front of the plane through its closest point with the pseudonormal of that
/// point [Baerentzen05].
class Pseudonormals {
 public:
  explicit Pseudonormals(const LocalMesh& mesh);

  /// Returns the first edge with three or more faces, or with two faces that traverse it in the
  /// same direction. Empty: the mesh is consistently oriented.
  [[nodiscard]] const std::optional<UnorientedEdge>& unorientedEdge() const {
    return unorientedEdge_;
  }
  [[nodiscard]] std::size_t borderEdges() const { return borderEdges_; }

  struct Direction {
    Imath::V3d normal{0};  ///< unit length; zero if all adjacent faces are degenerate
    /// True at an edge with one face, at an unoriented edge, and at the ends of such edges: the
    /// normal does not tell the sides apart there.
    bool onBorder = false;
  };
  /// Returns the pseudonormal of a part of a triangle. 0 to 2: corner; 3 to 5: edge from corner
  /// part − 3 to the next; 6: face.
  [[nodiscard]] Direction at(std::uint32_t triangle, int part) const;

 private:
  const LocalMesh& mesh_;
  std::vector<Imath::V3d> faces_;
  std::vector<Direction> edges_, vertices_;
  std::vector<std::array<std::uint32_t, 3>> edgeOf_;
  std::optional<UnorientedEdge> unorientedEdge_;
  std::size_t borderEdges_ = 0;
};

}  // namespace levelset::convert
