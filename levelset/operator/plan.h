#pragma once

#include <Imath/ImathBox.h>

namespace levelset {

/// Estimate of a value before it is computed: enough to resolve lengths and to estimate cost.
struct ValuePlan {
  Imath::Box3d bounds = {};  ///< bounds of the zero set or of the vertices, world units
  double area = 0;           ///< area of the surface, world units²
  double voxelSize = 0;      ///< bands: world units; 0 for meshes
  double halfWidth = 0;      ///< bands: voxels
  double triangles = 0;      ///< meshes: number of triangles; 0: not known
  double fieldBytes = 0;     ///< fields: memory of the grid

  [[nodiscard]] bool isBand() const { return voxelSize > 0; }
  [[nodiscard]] double longestSide() const;
  /// Number of active voxels of a band of this area.
  [[nodiscard]] double activeVoxels() const;
  /// Number of grid points in a layer one voxel thick along the surface of a band.
  [[nodiscard]] double layer() const;
};

/// Memory of a band for each active voxel. A band fills about a third of its leaf blocks, so this
/// figure is measured, not computed.
inline constexpr double kBytesPerVoxel = 12;

/// The box with all its faces moved outwards. An infinite box stays infinite.
[[nodiscard]] Imath::Box3d grown(Imath::Box3d box, double by);

}  // namespace levelset
