#pragma once

#include <Imath/ImathVec.h>

#include <vector>

#include "levelset/narrow_band.h"

namespace viewer {

/// Discs that cover the surface of a solid [Brodersen07 §6.4]. World units.
struct SurfaceDiscs {
  std::vector<Imath::V3f> positions;  ///< feet of the grid points near the surface
  std::vector<Imath::V3f> normals;    ///< outward unit normals
  /// Radius of the discs. Every point of a flat surface has a grid point within √3/2 voxel, so its
  /// foot is no further away. The radius is a quarter larger, for bent surfaces.
  float radius = 0;
};

/// Computes the feet p − φ(p) ∇φ / |∇φ| of all active grid points p with |φ(p)| ≤ √3/2 voxel, with
/// ∇φ from central differences. The order of the points does not depend on the number of threads.
[[nodiscard]] SurfaceDiscs surfaceDiscs(const levelset::NarrowBand& band);

}  // namespace viewer
