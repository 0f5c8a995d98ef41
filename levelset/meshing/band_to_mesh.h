#pragma once

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct BandToMeshOptions {
  double adaptivity = 0;  ///< [0, 1]: how far flat parts may be coarsened; 0 is uniform
  bool sharp =
      false;  ///< keep the edges and corners that the field implies [Ju02]; not with adaptivity
  bool openSurface = false;  ///< take open surfaces too, with walls where they are cut off
  Progress progress = {};
};

/// The zero set as a triangle mesh that faces outwards: closed and 2-manifold for a band whose zero
/// set is closed.
/// @return vertices on the zero set of the trilinear interpolant to second order in the voxel size
/// @throws InvalidInput if the band is empty, or an open surface; UsageError for options out of
/// range
[[nodiscard]] TriMesh bandToMesh(const NarrowBand& band, const BandToMeshOptions& options = {});

}  // namespace levelset
