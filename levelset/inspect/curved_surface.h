#pragma once

// Integrals over the zero set. Includes OpenVDB: for .cpp files only.

#include <array>
#include <vector>

#include "levelset/distance/interpolant.h"
#include "levelset/meshing/cell_surface.h"

namespace levelset {

/// Integrals over a closed surface that faces out, and by the divergence theorem over the solid
/// inside it: moments about an anchor.
struct SurfaceMoments {
  double volume = 0;
  double area = 0;
  double meanCurvature = 0;  ///< ∫ (k1 + k2) / 2 dA
  openvdb::Vec3d first = openvdb::Vec3d(0);
  std::array<double, 6> second = {};  ///< xx, yy, zz, xy, xz, yz

  void add(const SurfaceMoments& other);
  /// About a point that lies at `shift` from the old anchor.
  [[nodiscard]] SurfaceMoments about(const openvdb::Vec3d& shift) const;
};

/// Of a flat triangle: exact, without the curvature, which is in the mesh's edges.
[[nodiscard]] SurfaceMoments flatTriangleMoments(const openvdb::Vec3d& a, const openvdb::Vec3d& b,
                                                 const openvdb::Vec3d& c);

/// The triangles of the uniform mesh, each bent onto the zero set of the tricubic interpolant: a
/// point of a triangle moves along a normal that is interpolated between its vertices, so that
/// neighbours share their sides and the whole is covered once. Where the field is no smooth
/// distance, at edges above all, a triangle stays flat. Index space.
class CurvedSurface {
 public:
  /// Keeps a view of the mesh. @param grid  the field that the mesh was made from
  CurvedSurface(const IndexMesh& mesh, const openvdb::FloatGrid& grid);

  /// One per thread.
  using Cache = eikonal::DenseBlockCache;
  [[nodiscard]] Cache makeCache() const { return Cache(*field_); }

  /// By a quadrature rule of degree four. @param anchor  that the moments are about
  [[nodiscard]] SurfaceMoments moments(std::size_t triangle, const openvdb::Vec3d& anchor,
                                       Cache& cache) const;

  struct Sample {
    openvdb::Vec3d position;
    double area = 0;
    bool isFlat = true;  ///< in the triangle, which stands for an edge that the interpolant rounds
  };
  /// The middle of a triangle, with its area.
  [[nodiscard]] Sample middle(std::size_t triangle, Cache& cache) const;

 private:
  struct Node {
    openvdb::Vec3d position, areaVector;
    double meanCurvature = 0;  ///< times area
    bool isFlat = true;
  };
  [[nodiscard]] Node node(std::size_t triangle, bool bends, double u, double v, Cache& cache) const;
  [[nodiscard]] bool isSmooth(std::size_t triangle) const;
  void findNormals();

  const IndexMesh& mesh_;
  openvdb::FloatTree::ConstPtr field_;
  std::vector<openvdb::Vec3f> normals_;  ///< unit, at the vertices; zero where unknown
};

}  // namespace levelset
