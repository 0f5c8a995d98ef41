#pragma once

// Integrals over the zero set. Includes OpenVDB, so include it from .cpp files only.

#include <array>
#include <vector>

#include "levelset/distance/surface/interpolant.h"
#include "levelset/meshing/cells/cell_surface.h"

namespace levelset {

/// Integrals over a closed surface that faces outwards. By the divergence theorem, they include the
/// moments of the enclosed solid about an anchor.
struct SurfaceMoments {
  double volume = 0;
  double area = 0;
  double meanCurvature = 0;                  ///< ∫ (k1 + k2) / 2 dA
  openvdb::Vec3d first = openvdb::Vec3d(0);  ///< ∫ x dV, x relative to the anchor
  std::array<double, 6> second = {};         ///< ∫ of xx, yy, zz, xy, xz and yz over the volume

  void add(const SurfaceMoments& other);
  /// Returns the moments about a new anchor, `shift` away from the old one.
  [[nodiscard]] SurfaceMoments about(const openvdb::Vec3d& shift) const;
};

/// Exact moments of a flat triangle about the origin of its coordinates. Its mean curvature is
/// zero: the curvature of a mesh lies in its edges.
[[nodiscard]] SurfaceMoments flatTriangleMoments(const openvdb::Vec3d& a, const openvdb::Vec3d& b,
                                                 const openvdb::Vec3d& c);

/// Moments of a quadratic patch about the origin of its coordinates: the flat triangle, and for
/// each pair of barycentric coordinates λ_i λ_j times the bend of their side.
/// @param bend  of the side from each corner to the next one
/// @param normal  unit normals of the surface at the corners, which give its mean curvature
[[nodiscard]] SurfaceMoments quadraticPatchMoments(const std::array<openvdb::Vec3d, 3>& corner,
                                                   const std::array<openvdb::Vec3d, 3>& bend,
                                                   const std::array<openvdb::Vec3d, 3>& normal);

/// The triangles of the uniform mesh, bent onto the zero set of the tricubic interpolant. A point
/// of a triangle moves along a normal interpolated between the vertices. Neighbours therefore share
/// their sides, and the triangles cover the surface exactly once. A triangle stays flat where the
/// field is no smooth distance, mainly at edges. Index space.
class CurvedSurface {
 public:
  /// Keeps a reference to the mesh, which must outlive this object.
  /// @param grid  level set from which the mesh was extracted
  CurvedSurface(const IndexMesh& mesh, const openvdb::FloatGrid& grid);

  /// Scratch memory, one per thread.
  using Cache = eikonal::DenseBlockCache;
  [[nodiscard]] Cache makeCache() const { return Cache(*field_); }

  /// Integrates over a triangle by a quadrature rule of degree four.
  /// @param anchor  reference point of the moments
  [[nodiscard]] SurfaceMoments moments(std::size_t triangle, const openvdb::Vec3d& anchor,
                                       Cache& cache) const;

  struct Sample {
    openvdb::Vec3d position;
    double area = 0;
    bool isFlat = true;  ///< true: the point lies on a triangle that stays flat, mainly at an edge
                         ///< of the solid, which the interpolant would round
  };
  /// Midpoint of a triangle and the triangle's area.
  [[nodiscard]] Sample middle(std::size_t triangle, Cache& cache) const;

 private:
  struct Node {
    openvdb::Vec3d position, areaVector;
    double meanCurvature = 0;  ///< (k1 + k2) / 2 at the node, times the triangle's area
    bool isFlat = true;
  };
  [[nodiscard]] Node node(std::size_t triangle, bool bends, double u, double v, Cache& cache) const;
  [[nodiscard]] bool isSmooth(std::size_t triangle) const;
  void findNormals();

  const IndexMesh& mesh_;
  openvdb::FloatTree::ConstPtr field_;
  /// Unit normals at the vertices, index space; zero where the gradient vanishes.
  std::vector<openvdb::Vec3f> normals_;
};

}  // namespace levelset
