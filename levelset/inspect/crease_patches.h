#pragma once

// Integrals over the surface beside sharp edges. Includes OpenVDB, so include it from .cpp files
// only.

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "levelset/inspect/curved_surface.h"
#include "levelset/meshing/cells/divide_sides.h"
#include "levelset/meshing/extended/extended_surface.h"

namespace levelset {

/// Triangles of extended marching cubes near edges and corners of the solid, as quadratic patches.
/// The interpolant rounds edges, so the normals at the vertices give the curvature of the faces.
/// An edge of the solid is one curve, which both faces share. Index space.
class CreasePatches {
 public:
  /// Moves the vertices that are not near an edge of the solid onto the zero set of the tricubic
  /// interpolant. Keeps a reference to the mesh, which must outlive this object.
  /// @param crossings  from which the mesh was made
  CreasePatches(ExtendedSurface& mesh, const EdgeCrossings& crossings,
                const openvdb::FloatGrid& grid);

  /// True for a triangle that moments() covers. Those farther from edges belong to CurvedSurface.
  [[nodiscard]] bool contains(std::size_t triangle) const { return slots_[triangle] != kElsewhere; }
  /// Integrates over a triangle. @param anchor  reference point of the moments
  [[nodiscard]] SurfaceMoments moments(std::size_t triangle, const openvdb::Vec3d& anchor) const;
  /// Integral of the mean curvature over the edges of the solid: half the sum of length times
  /// angle, positive at convex edges [Steiner40].
  [[nodiscard]] double edgeCurvature() const { return edgeCurvature_; }
  /// Returns the mesh with each patch as four triangles, whose vertices lie on the patch. Its
  /// neighbours are halved at common sides.
  [[nodiscard]] IndexMesh divided() const;
  /// For each vertex of divided(): true if it lies on an edge or a corner of the solid, or between
  /// two of those that do.
  [[nodiscard]] std::vector<bool> features() const;

 private:
  static constexpr std::uint32_t kElsewhere = 0xffffffffu;
  struct Patch {
    std::array<openvdb::Vec3d, 3> normal;  ///< normals of the face, at the vertices
    std::array<openvdb::Vec3d, 3> bend;    ///< bends of the side that begins at each vertex
  };

  [[nodiscard]] bool isFeature(std::uint32_t vertex) const {
    return mesh_.crossing[vertex] == ExtendedSurface::kFeature;
  }
  [[nodiscard]] openvdb::Vec3d triangleNormal(std::size_t triangle) const;
  void findNear(const openvdb::FloatGrid& grid);
  void findNormals();
  void bendSides();

  ExtendedSurface& mesh_;
  std::vector<std::uint32_t> slots_;  ///< index of the patch of each triangle
  std::vector<std::uint32_t> near_;   ///< triangles with a patch
  std::vector<Patch> patches_;
  std::vector<SideMiddle> middles_;      ///< middles of the sides of patches, in ascending order
  std::vector<openvdb::Vec3d> normals_;  ///< normals of vertices on faces
  double edgeCurvature_ = 0;
};

}  // namespace levelset
