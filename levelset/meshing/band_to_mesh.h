#pragma once

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct BandToMeshOptions {
  double adaptivity = 0;  ///< [0, 1]: tolerance of coarsening, voxels; 0 keeps the uniform mesh
  /// Keeps the edges and corners that the field implies [Ju02]; excludes adaptivity.
  bool sharp = false;
  bool openSurface = false;  ///< accepts open surfaces, closed with walls at their cut
  Progress progress = {};
};

/// Converts the zero set to a triangle mesh that faces outwards. The mesh is closed and 2-manifold
/// when the zero set is closed.
/// @return vertices on the zero set of the trilinear interpolant to second order in the voxel size
/// @throws InvalidInput if the band is empty, or an open surface
/// @throws UsageError for options out of range
[[nodiscard]] TriMesh bandToMesh(const NarrowBand& band, const BandToMeshOptions& options = {});

}  // namespace levelset
