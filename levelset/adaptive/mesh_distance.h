#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/adaptive/build_adaptive.h"
#include "levelset/convert/mesh_to_band.h"
#include "levelset/convert/pseudonormals.h"
#include "levelset/geometry/search/triangle_search.h"
#include "levelset/mesh_sign/local_mesh.h"
#include "levelset/mesh_sign/winding.h"

namespace levelset {

/// Exact signed distance of the solid that a mesh describes, at any position. The sign is that of
/// meshToBand(), but where it is ambiguous. Holes are spanned by the surface of winding number 1/2.
class MeshDistance final : public SignedDistance {
 public:
  /// @param voxel  resolution of the surface that spans holes, world units
  /// @throws InvalidInput for a mesh without area, and if triangles that share an edge have
  ///         opposite orientations
  /// @throws as the method of signs demands, see meshToBand()
  MeshDistance(const TriMesh& mesh, double voxel, const MeshToBandOptions& options);

  [[nodiscard]] double at(const Imath::V3d& position, const Known& known) const override;
  /// Points away from the closest point of the surface. On the surface, the normal there.
  [[nodiscard]] Imath::V3d gradient(const Imath::V3d& position, double value,
                                    double step) const override;
  /// Visits the vertices in the box, and the ends and the middle of each edge in it.
  void visitSurface(const Imath::Box3d& box, const Visit& visit) const override;
  /// Certificate of the mesh. Its ambiguous share is a share of the area.
  [[nodiscard]] const SignCertificate& certificate() const { return certificate_; }

 private:
  void orientComponents();
  void requireOrientation() const;
  void orientSpan(std::size_t first, const convert::WindingField& given);
  void findSeparating();
  void measureAmbiguity(const convert::WindingField& given);
  [[nodiscard]] bool isInside(const Imath::V3d& local, std::uint32_t triangle) const;

  double voxel_;
  Imath::V3d origin_;  ///< voxels
  convert::LocalMesh mesh_;
  SignCertificate certificate_;
  double flip_ = 1;
  TriangleSearch search_;
  std::optional<convert::Pseudonormals> normals_;  ///< refer to mesh_
  convert::WindingField winding_;                  ///< refers to mesh_
  /// True for each triangle with the outside in front and the inside behind; empty: all.
  std::vector<bool> separates_;
};

}  // namespace levelset
