#pragma once

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct CompareOptions {
  Progress progress = {};
};

/// World units. Distances are without sign.
struct Comparison {
  double hausdorffAtoB = 0;  ///< how far the surface of A gets from that of B
  double hausdorffBtoA = 0;
  double meanAtoB = 0;  ///< mean over the surface of A of the distance to that of B
  double meanBtoA = 0;
  double symmetricDifference = 0;  ///< volume that is in one of the solids only

  [[nodiscard]] double hausdorff() const {
    return hausdorffAtoB > hausdorffBtoA ? hausdorffAtoB : hausdorffBtoA;
  }
  /// Sum of both means, of the distances themselves and not of their squares.
  [[nodiscard]] double chamfer() const { return meanAtoB + meanBtoA; }
};

/// How far two solids differ. Each surface is sampled about once per square of half a voxel, on the
/// zero set of the tricubic interpolant; distances are to the other's zero set, found by Newton's
/// method, on its own grid. The volume is summed over tetrahedra on which both fields are linear,
/// on the grid points of the finer. Any two grids.
/// @throws InvalidInput if a solid has no surface; Cancelled
[[nodiscard]] Comparison compare(const NarrowBand& a, const NarrowBand& b,
                                 const CompareOptions& options = {});

}  // namespace levelset
