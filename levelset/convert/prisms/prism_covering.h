#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <vector>

#include "levelset/mesh_sign/local_mesh.h"

namespace levelset::convert {

/// For each triangle, a prism: a polyhedron around it that scan conversion visits instead of all
/// grid points within reach [Sigg06, 4.2.3]. A point within `reach` of the mesh lies in the prism
/// of a triangle that contains its closest point.
///
/// The triangle divides its prism into two halves. A half ends at the distance `reach` from the
/// plane of the triangle. At each edge it ends at a plane that leans outwards by `slope` and is
/// moved outwards by `shift`. The half contains all points above the triangle. Beside a convex
/// edge, it contains the points between this triangle and the bisector of the two normals. Beside a
/// vertex, it contains a sector of the cone of points that the vertex is closest to.
///
/// Sigg's prisms end at the bisector plane on both sides of each edge. They cover the same points,
/// apart from gaps at saddle vertices. On the concave side of an edge, however, a point may lie
/// in the prism of the neighbour but be closer to this triangle. There our planes are
/// perpendicular.
class PrismCovering {
 public:
  struct Half {
    std::array<float, 3> slope{};  ///< growth of the distance from the edge with the height
    std::array<float, 3> shift{};  ///< distance of the plane from the edge at height 0, voxels
  };
  struct Prism {
    Half front, back;  ///< on the side of the normal, and on the other side
    Imath::V3f normal;
    /// Directions in the plane of the triangle, perpendicular to an edge and outwards. Zero for a
    /// triangle without area.
    std::array<Imath::V3f, 3> outward;
    float margin = 0;  ///< length, voxels, that rounding may move a plane by
  };

  /// @param mesh   triangles over welded vertices; any set of triangles is valid
  /// @param reach  largest distance of the points to cover, voxels
  PrismCovering(const LocalMesh& mesh, double reach);

  [[nodiscard]] const Prism& prism(std::uint32_t triangle) const { return prisms_[triangle]; }
  [[nodiscard]] double reach() const { return reach_; }
  /// Number of triangles whose prism is the whole neighbourhood, because they or one of their
  /// vertices are irregular: at a border, where three faces share an edge, or without area.
  [[nodiscard]] std::size_t wholeCount() const { return whole_; }

 private:
  double reach_;
  std::size_t whole_ = 0;
  std::vector<Prism> prisms_;
};

/// The planes of a prism in coordinates relative to an origin. Tests and scan conversion share
/// them.
class PrismPlanes {
 public:
  PrismPlanes(const std::array<Imath::V3d, 3>& corners, const PrismCovering::Prism& prism,
              double reach);

  /// A half-space: the points p with normal · p ≤ limit.
  struct Plane {
    Imath::V3d normal;
    double limit;
  };
  /// Five planes of a half: base, cap, and one at each edge. They are moved outwards by a little,
  /// so that rounding leaves no gaps.
  using HalfPlanes = std::array<Plane, 5>;
  [[nodiscard]] HalfPlanes half(bool isFront) const;

  [[nodiscard]] bool contains(const Imath::V3d& point) const;
  /// Returns false only if no point of the cube lies in the prism.
  [[nodiscard]] bool mayTouch(const Imath::V3d& centre, double halfEdge) const;

 private:
  const PrismCovering::Prism* prism_;
  double reach_, slack_;
  Imath::V3d normal_;
  double level_;                       // normal · p on the plane of the triangle
  std::array<Imath::V3d, 3> outward_;  // in that plane, perpendicular to an edge, unit length
  std::array<double, 3> edgeLevel_{};  // outward · p on the edge
};

}  // namespace levelset::convert
