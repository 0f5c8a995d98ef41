#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/mesh_sign/local_mesh.h"

namespace levelset::convert {

/// An edge at which the faces do not form one oriented surface.
struct UnorientedEdge {
  Imath::V3d from, to;  ///< end points, in the units of the mesh
  std::size_t faces = 0;
};

/// Normals at the faces, edges and vertices of a mesh. A point lies in front of the surface exactly
/// if it lies in front of the plane through its closest point with that normal [Baerentzen05].
class Pseudonormals {
 public:
  explicit Pseudonormals(const LocalMesh& mesh);

  /// The first edge with three or more faces, or with two faces that run along it in the same
  /// direction.
  [[nodiscard]] const std::optional<UnorientedEdge>& unorientedEdge() const {
    return unorientedEdge_;
  }
  [[nodiscard]] std::size_t borderEdges() const { return borderEdges_; }

  struct Direction {
    Imath::V3d normal{0};  ///< unit length; zero where all faces are degenerate
    bool onBorder = false;
  };
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
