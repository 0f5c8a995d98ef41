#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/mesh_sign/local_mesh.h"

namespace levelset::convert {

/// An edge at which the faces do not make one oriented surface.
struct UnorientedEdge {
  Imath::V3d from, to;  ///< in the mesh's units
  std::size_t faces = 0;
};

/// Directions across a mesh at faces, edges and vertices, such that a point lies in front of the
/// surface exactly if it lies in front of the plane at its closest point [Baerentzen05].
class Pseudonormals {
 public:
  explicit Pseudonormals(const LocalMesh& mesh);

  /// The first edge with three or more faces, or whose two faces run along it the same way.
  [[nodiscard]] const std::optional<UnorientedEdge>& flaw() const { return flaw_; }
  [[nodiscard]] std::size_t borderEdges() const { return borderEdges_; }

  struct Direction {
    Imath::V3d normal{0};  ///< unit length; zero where all faces lack area
    bool onBorder = false;
  };
  [[nodiscard]] Direction at(std::uint32_t triangle, int part) const;

 private:
  const LocalMesh& mesh_;
  std::vector<Imath::V3d> faces_;
  std::vector<Direction> edges_, vertices_;
  std::vector<std::array<std::uint32_t, 3>> edgeOf_;
  std::optional<UnorientedEdge> flaw_;
  std::size_t borderEdges_ = 0;
};

}  // namespace levelset::convert
