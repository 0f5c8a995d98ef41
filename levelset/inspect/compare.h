#pragma once

#include <cstddef>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct CompareOptions {
  std::size_t maxMemory = kNoMemoryLimit;  ///< for the meshes of adaptive fields
  Progress progress = {};
};

/// Differences between two solids, world units. Distances are unsigned.
struct Comparison {
  double hausdorffAtoB = 0;        ///< largest distance of the surface of A from that of B
  double hausdorffBtoA = 0;        ///< largest distance of the surface of B from that of A
  double meanAtoB = 0;             ///< mean distance of the surface of A from that of B
  double meanBtoA = 0;             ///< mean distance of the surface of B from that of A
  double symmetricDifference = 0;  ///< volume inside exactly one of the solids, world units³

  [[nodiscard]] double hausdorff() const {
    return hausdorffAtoB > hausdorffBtoA ? hausdorffAtoB : hausdorffBtoA;
  }
  /// Chamfer distance: sum of the two mean distances, not of mean squared distances.
  [[nodiscard]] double chamfer() const { return meanAtoB + meanBtoA; }
};

/// Measures the difference of two solids, on any two grids.
/// Samples each surface with a spacing of about half a voxel, on the zero set of the tricubic
/// interpolant. Newton's method finds the distance of each sample to the zero set of the other
/// solid, on the grid of that solid. The volume of the symmetric difference is summed over
/// tetrahedra with linear fields, on the grid points of the finer grid.
/// @throws InvalidInput if a solid has no surface
/// @throws Cancelled
[[nodiscard]] Comparison compare(const NarrowBand& a, const NarrowBand& b,
                                 const CompareOptions& options = {});

}  // namespace levelset
