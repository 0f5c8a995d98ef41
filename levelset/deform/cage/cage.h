#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "levelset/deform/deformation.h"
#include "levelset/mesh.h"
#include "levelset/progress.h"

/// Deformation by cages: closed triangle meshes whose vertices are moved.
namespace levelset {

namespace cage {
struct CageTriangle;
struct Sloped;
}  // namespace cage

enum class CageCoordinates {
  MeanValue,  ///< [Ju05]: reproduce affine maps; defined everywhere
  Green       ///< [Lipman08]: also use the normals, and reproduce similarities; defined inside
};

/// The map that a cage at rest and a moved cage of the same triangles give. Immutable.
///
/// With mean-value coordinates λ_i, x moves to Σ λ_i(x) p'_i. The faces of the cage move linearly,
/// and the map is smooth everywhere but on edges and vertices, where it is continuous.
///
/// With Green coordinates φ_i and ψ_t, x moves to Σ φ_i(x) p'_i + Σ ψ_t(x) s_t n'_t, where n'_t is
/// the normal of a moved triangle and s_t its stretch. Faces of the cage do not move with it
/// exactly. Without shear this preserves shapes better. On and behind the faces the map continues
/// with the limit from inside or does not continue at all, so solids must lie inside.
///
/// On an edge or a vertex, where derivatives depend on the direction, jet() has those at a point
/// 1e-6 of the diagonal inside.
class CageDeformation final : public Deformation {
 public:
  /// @param rest   closed mesh without self-intersections, facing outwards or inwards
  /// @param moved  the same triangles with other positions
  /// @throws InvalidInput if `rest` is not closed, intersects itself, or has a triangle without
  ///         area; if the triangles of the two differ; and, for Green coordinates, if a moved
  ///         triangle has no area
  CageDeformation(const TriMesh& rest, const TriMesh& moved, CageCoordinates coordinates,
                  const Progress& progress = {});
  ~CageDeformation() override;

  [[nodiscard]] DeformationJet jet(const Imath::V3d& world) const override {
    return jet(world, nullptr);
  }
  /// Internal: stores the sum of the mean-value weights too, which is not scaled then.
  [[nodiscard]] DeformationJet jet(const Imath::V3d& world, cage::Sloped* total) const;
  [[nodiscard]] bool isIdentity() const override;
  [[nodiscard]] Imath::Box3d bounds() const override;
  void requireDefined(const std::vector<Imath::V3d>& points, const char* what) const override;
  /// Bounds the Jacobian over boxes of an octree. In a box with the centre c and the radius r, the
  /// Jacobian differs from that at c by at most r times a bound of the second derivatives. The
  /// bound is an integral over the cage of how far it is from the affine map at c. A box that
  /// reaches the cage has no bound, so the domain must keep a small distance from the cage.
  [[nodiscard]] CertifiedDeformation certify(const DeformationDomain& domain,
                                             const CertifyOptions& options = {}) const override;

  /// Returns true for a point inside the cage at rest; a point on a face may be either.
  [[nodiscard]] bool contains(const Imath::V3d& world) const;
  [[nodiscard]] CageCoordinates coordinates() const;
  [[nodiscard]] const std::vector<std::array<std::uint32_t, 3>>& triangles() const;
  [[nodiscard]] const std::vector<Imath::V3d>& rest() const;
  [[nodiscard]] const std::vector<Imath::V3d>& moved() const;
  /// Returns the same cage at rest with other moved vertices.
  /// @throws InvalidInput for another number of positions, or positions that are not finite
  [[nodiscard]] CageDeformation withMoved(std::vector<Imath::V3d> moved) const;

  /// Internal: the triangles at rest, and the moved normal of one times its stretch.
  [[nodiscard]] const std::vector<cage::CageTriangle>& parts() const;
  [[nodiscard]] Imath::V3d stretchedNormalOf(std::size_t triangle) const;

  /// Coordinates at a point: one for each vertex and, of Green coordinates, one for each triangle.
  struct Coordinates {
    std::vector<double> vertices, triangles;
    std::vector<Imath::V3d> vertexSlopes, triangleSlopes;  ///< gradients
  };
  [[nodiscard]] Coordinates coordinatesAt(const Imath::V3d& world) const;

 private:
  struct Shared;
  explicit CageDeformation(std::shared_ptr<const Shared> shared) : shared_(std::move(shared)) {}
  std::shared_ptr<const Shared> shared_;
};

}  // namespace levelset
