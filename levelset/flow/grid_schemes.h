#pragma once

// For the .cpp files of levelset/flow only.

#include "levelset/flow/time_interval.h"
#include "levelset/narrow_band.h"

namespace levelset::flow {

/// φ at the feet of backward characteristics (classical Runge-Kutta), interpolated tricubically;
/// a signed distance again after each step. Works in a band of five voxels, or the solid's own if
/// that is wider.
/// @return the number of steps
std::size_t carryBySemiLagrange(NarrowBand& band, const TimeInterval& journey);

/// HJ-WENO5 with TVD-RK3, a signed distance again whenever the surface has moved a voxel and a
/// half.
/// @return the number of steps, as the CFL condition makes them
std::size_t carryUpwind(NarrowBand& band, const TimeInterval& journey);

}  // namespace levelset::flow
