#pragma once

#include <cstddef>
#include <utility>

#include "levelset/deform/deformation.h"
#include "levelset/mesh.h"
#include "levelset/points/point_cloud.h"
#include "levelset/progress.h"

namespace levelset {

struct DeformMeshOptions {
  /// Largest distance between an edge and the curve that the map makes of the undeformed edge,
  /// world units. Edges beyond it are halved. 0: no edge is halved.
  double tolerance = 0;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct DeformMeshResult {
  TriMesh mesh;
  FoldCertificate certificate;
  std::size_t halvedEdges = 0;
  /// Largest distance, at a quarter, the middle and three quarters of the edges of the result,
  /// between the edge and the deformed undeformed edge, world units. Inside a triangle it is at
  /// most 4/3 of that where the map is quadratic over the triangle.
  double bend = 0;
};

/// Deforms a mesh. Triangles are divided where the map bends their edges by more than the
/// tolerance. The decision for an edge depends on the positions of its ends alone, so triangles on
/// both sides are divided alike, also along seams: there are no cracks. Normals transform by the
/// inverse transpose of the Jacobian; other attributes are interpolated. An identity
/// returns the mesh itself.
/// @throws InvalidInput for a map that is not proven to be injective, a vertex where it is not
///         defined, or attributes that do not fit
/// @throws UsageError for a tolerance that is negative or not finite
/// @throws ResourceLimit if the divided mesh exceeds the memory
[[nodiscard]] DeformMeshResult deformMesh(const TriMesh& mesh, const Deformation& deformation,
                                          const DeformMeshOptions& options = {});
[[nodiscard]] inline DeformMeshResult deformMesh(const TriMesh& mesh, const ControlLattice& lattice,
                                                 const DeformMeshOptions& options = {}) {
  return deformMesh(mesh, LatticeDeformation(lattice), options);
}

struct DeformPointsResult {
  PointCloud cloud;
  FoldCertificate certificate;
};

/// Deforms a point cloud. Normals transform by the inverse transpose of the Jacobian, radii by the
/// cube root of its determinant; colours and weights stay.
/// @throws InvalidInput as deformMesh()
[[nodiscard]] DeformPointsResult deformPoints(PointCloud cloud, const Deformation& deformation,
                                              const CertifyOptions& options = {});
[[nodiscard]] inline DeformPointsResult deformPoints(PointCloud cloud,
                                                     const ControlLattice& lattice,
                                                     const CertifyOptions& options = {}) {
  return deformPoints(std::move(cloud), LatticeDeformation(lattice), options);
}

}  // namespace levelset
