#pragma once

#include <cstddef>
#include <cstdint>

#include "levelset/mesh.h"
#include "levelset/progress.h"
#include "levelset/volumes/filters/volume_filter.h"
#include "levelset/volumes/volume.h"

namespace levelset {

/// Treatment of a surface that reaches the border of the volume.
enum class MeshBorder {
  Close,  ///< flat faces on the volume's box close the mesh
  Open,   ///< the mesh has an open boundary there
  Refuse  ///< the surface is refused
};

struct IsosurfaceMeshOptions {
  bool isInsideBelow = false;  ///< true: values below the isovalue are inside, else those above it
  /// Filter of which each vertex lies on the surface: Trilinear or Tricubic. Both interpolate the
  /// values, so that the signs at the grid points determine the same triangles.
  VolumeFilter filter = VolumeFilter::Trilinear;
  MeshBorder border = MeshBorder::Close;
  bool hasNormals = true;  ///< true: the vertices have unit normals, which point outside
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct IsosurfaceMesh {
  TriMesh mesh;
  std::uint64_t cells = 0;         ///< cells that the surface crosses
  std::uint64_t borderPoints = 0;  ///< grid points on the border of the volume that are inside
};

/// Makes a mesh of an isosurface directly from the numbers of a volume, by marching cubes with the
/// cases of meshing/cells/cell_table.h. It visits rows of grid points as Flying Edges does
/// [Schroeder15]. A grid point of the isovalue is outside. Vertices keep a distance of 10⁻⁴ of the
/// spacing from the grid points, so that no triangle is without area.
///
/// The mesh is 2-manifold. It is closed unless it is open at the border. Normals are gradients by
/// finite differences of fourth order in the interior of the volume. The result does not depend on
/// the number of threads.
/// @throws UsageError for an isovalue that is not finite, or another filter
/// @throws NoSurface when no value, or every value, is inside
/// @throws InvalidInput for a volume with one grid point along an axis, or with MeshBorder::Refuse
///         when the solid reaches the border
/// @throws ResourceLimit before the memory exceeds its limit, or for more than 2³² − 1 vertices
/// @throws Cancelled
[[nodiscard]] IsosurfaceMesh isosurfaceMesh(const Volume& volume, double isovalue,
                                            const IsosurfaceMeshOptions& options = {});

}  // namespace levelset
