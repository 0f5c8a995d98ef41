#pragma once

#include <Imath/ImathVec.h>

#include <memory>
#include <vector>

#include "levelset/mesh.h"
#include "levelset/progress.h"

namespace levelset {

/// A surface of triangles, made ready for distances to it. Copies share it.
class TriangleSurface {
 public:
  TriangleSurface() = default;
  /// @throws InvalidInput for a mesh without triangles
  explicit TriangleSurface(TriMesh mesh);

  /// False of one that was default constructed, which has nothing to ask for.
  [[nodiscard]] bool isValid() const { return data_ != nullptr; }
  [[nodiscard]] const TriMesh& mesh() const;
  /// World units, without sign; exact to rounding.
  /// @param limit  a distance that it is known not to pass: the nearer, the sooner found
  [[nodiscard]] double distance(const Imath::V3d& point, double limit) const;

 private:
  struct Data;
  std::shared_ptr<const Data> data_;
};

struct SurfaceDifferenceOptions {
  /// World units: triangles are cut into parts with sides no longer than this.
  double spacing = 0;
  std::vector<Imath::V3d> creases = {};  ///< points along creases
  double creaseReach = 0;                ///< what is nearer to one of them is told apart
  Progress progress = {};
};

/// World units.
struct SurfaceDifference {
  double smooth = 0;       ///< two-sided Hausdorff distance of what lies away from creases
  double crease = 0;       ///< the same of what lies beside them
  double creaseShare = 0;  ///< of the samples
};

/// How far two surfaces are apart: the largest distance from samples of each to the other. Samples
/// are the vertices and the middles of the parts that the triangles are cut into; where distances
/// are largest, of parts a fourth as long.
/// @throws Cancelled
[[nodiscard]] SurfaceDifference surfaceDifference(const TriangleSurface& a,
                                                  const TriangleSurface& b,
                                                  const SurfaceDifferenceOptions& options);

/// Vertices of a uniform mesh at which its normals turn within about two voxels, and turn by as
/// much in a coarser mesh of the same surface within two of its own voxels. A bend that is resolved
/// turns half as much in half the distance; an edge, or a seam of two solids, by the same angle at
/// every scale.
/// @param fine    bandToMesh() of a band with voxels of that size, as is `coarse`
/// @return        positions, world units
[[nodiscard]] std::vector<Imath::V3d> findCreases(const TriMesh& fine, double fineVoxel,
                                                  const TriMesh& coarse, double coarseVoxel);

/// How far the two faces at an edge are flat, at the edge of at least 45 degrees where that is
/// most: with smaller voxels a field shows a crease there. World units; 0 without such edges.
[[nodiscard]] double flatBesideEdges(const TriMesh& mesh);

}  // namespace levelset
