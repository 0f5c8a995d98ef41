#pragma once

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct CompareOptions {
  Progress progress = {};
};

/// Differences between two solids, world units. Distances are unsigned.
struct Comparison {
  double hausdorffAtoB = 0;  ///< largest distance of the surface of A from that of B
  double hausdorffBtoA = 0;
  double meanAtoB = 0;  ///< mean distance of the surface of A from that of B
  double meanBtoA = 0;
  double symmetricDifference = 0;  ///< volume inside exactly one of the solids

  [[nodiscard]] double hausdorff() const {
    return hausdorffAtoB > hausdorffBtoA ? hausdorffAtoB : hausdorffBtoA;
  }
  /// Sum of both means: of the distances themselves, not of their squares.
  [[nodiscard]] double chamfer() const { return meanAtoB + meanBtoA; }
};

/// Measures the difference of two solids, on any two grids.
///
/// Takes about one sample of each surface per square of half a voxel, on the zero set of the
/// tricubic interpolant. Newton's method finds the distance to the other zero set, on the other
/// solid's grid. The volume is a sum over tetrahedra with linear fields, on the grid points of the
/// finer grid.
/// @throws InvalidInput if a solid has no surface
/// @throws Cancelled
[[nodiscard]] Comparison compare(const NarrowBand& a, const NarrowBand& b,
                                 const CompareOptions& options = {});

}  // namespace levelset
