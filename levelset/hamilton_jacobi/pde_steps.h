#pragma once

#include <cmath>

// Internal header of levelset: public headers must not include it. Extent and number of steps of
// pdeRedistance(), which its cost estimate needs too.

namespace levelset::flow {

/// Step of pdeRedistance() in voxel sizes. |S| ≤ 1, so that the limit for stability is 1/√3.
inline constexpr double kPdeStep = 0.5;
/// Time in voxel sizes beyond the half width. The fronts start slowly, because S is small beside
/// the surface: from 0.1 voxel they need 1.9 more.
inline constexpr double kPdeDelay = 3;
/// Memory of pdeRedistance() per active grid point, bytes: up to six fields, in blocks that are
/// half active.
inline constexpr double kPdeBytes = 48;

/// Number of grid points on each side of the surface, along each axis, on which the equation is
/// solved. The stencils of the outer three are of first order, and the band's own read two grid
/// points ahead of it.
[[nodiscard]] inline int pdeReach(double halfWidth) {
  return static_cast<int>(std::ceil(halfWidth)) + 5;
}

/// Number of steps until the fronts have crossed the band.
[[nodiscard]] inline int pdeSteps(double halfWidth) {
  return static_cast<int>(std::ceil((halfWidth + kPdeDelay) / kPdeStep));
}

}  // namespace levelset::flow
