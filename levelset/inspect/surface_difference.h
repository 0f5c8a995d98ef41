#pragma once

#include <Imath/ImathVec.h>

#include <memory>
#include <vector>

#include "levelset/mesh.h"
#include "levelset/progress.h"

namespace levelset {

/// A triangle mesh prepared for distance queries. Copies share the mesh and its search tree.
class TriangleSurface {
 public:
  TriangleSurface() = default;
  /// @throws InvalidInput for a mesh without triangles
  explicit TriangleSurface(TriMesh mesh);

  /// Returns false for a default-constructed surface, which has no data.
  [[nodiscard]] bool isValid() const { return data_ != nullptr; }
  [[nodiscard]] const TriMesh& mesh() const;
  /// Unsigned distance of a point from the mesh, world units; exact to rounding.
  /// @param limit  known upper bound of the distance; a tight bound makes the search faster
  [[nodiscard]] double distance(const Imath::V3d& point, double limit) const;

 private:
  struct Data;
  std::shared_ptr<const Data> data_;
};

struct SurfaceDifferenceOptions {
  /// Maximum side of the parts into which triangles are divided for sampling, world units.
  double spacing = 0;
  std::vector<Imath::V3d> creases = {};  ///< points along creases, world units
  double creaseRadius = 0;  ///< radius around the crease points, world units; samples within it
                            ///< count for SurfaceDifference::crease
  Progress progress = {};
};

/// Differences of two surfaces, world units.
struct SurfaceDifference {
  double smooth = 0;       ///< two-sided Hausdorff distance of the samples away from creases
  double crease = 0;       ///< two-sided Hausdorff distance of the samples near creases
  double creaseShare = 0;  ///< fraction of the samples that lie near creases
};

/// Measures the largest distance of two surfaces, from samples of each to the other. The samples
/// are the vertices and the midpoints of the parts into which the triangles are divided. Where
/// distances are largest, the parts are a quarter as long.
/// @throws Cancelled
[[nodiscard]] SurfaceDifference surfaceDifference(const TriangleSurface& a,
                                                  const TriangleSurface& b,
                                                  const SurfaceDifferenceOptions& options);

/// Finds creases: vertices of a uniform mesh at which the normals turn within about two voxels. A
/// coarser mesh of the same surface must turn as much within two of its own voxels. A resolved bend
/// turns half as much over half the distance. A sharp edge or a seam of two solids turns by the
/// same angle at every scale.
/// @param fine  result of bandToMesh() for a band with voxels of size `fineVoxel`, world units
/// @param coarse  result of bandToMesh() for a band with voxels of size `coarseVoxel`
/// @return positions, world units
[[nodiscard]] std::vector<Imath::V3d> findCreases(const TriMesh& fine, double fineVoxel,
                                                  const TriMesh& coarse, double coarseVoxel);

/// Returns the width of the flat faces beside sharp edges, world units: the largest value over all
/// edges of at least 45 degrees. At one edge, it is the smaller height of the two triangles over
/// the edge. A field with voxels below this width resolves the crease. 0 without such edges.
[[nodiscard]] double flatBesideEdges(const TriMesh& mesh);

}  // namespace levelset
