#pragma once

#include <Imath/ImathBox.h>

namespace levelset {

/// Estimate of a value (a band, mesh or field) before it is computed. It suffices to resolve
/// lengths in voxels or percent and to estimate cost.
struct ValuePlan {
  Imath::Box3d bounds = {};  ///< bounds of the zero set or of the vertices, world units
  double area = 0;           ///< area of the surface, world units²
  double voxelSize = 0;      ///< voxel size of a band, world units; 0: the value is no band
  double halfWidth = 0;      ///< half width of a band, voxels
  double triangles = 0;      ///< number of triangles of a mesh; 0: not known
  double fieldBytes = 0;     ///< memory of the grid of a field, bytes

  [[nodiscard]] bool isBand() const { return voxelSize > 0; }
  [[nodiscard]] double longestSide() const;
  /// Number of active voxels of a band of this area; 0 if the value is no band.
  [[nodiscard]] double activeVoxels() const;
  /// Number of grid points in a layer one voxel thick along the surface of a band; 0 if the value
  /// is no band.
  [[nodiscard]] double layer() const;
};

/// Memory of a band for each active voxel, bytes. Measured; it exceeds 4 bytes, because only about
/// a third of the voxels in the leaf blocks of a band are active.
inline constexpr double kBytesPerVoxel = 12;

/// The box with all its faces moved outwards by `by`, in the unit of the box; negative: inwards. An
/// infinite box stays infinite.
[[nodiscard]] Imath::Box3d grown(Imath::Box3d box, double by);

}  // namespace levelset
