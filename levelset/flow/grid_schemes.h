#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/flow/time_interval.h"
#include "levelset/narrow_band.h"

namespace levelset::flow {

/// φ at the feet of backward characteristics (classical Runge-Kutta), interpolated tricubically;
/// a signed distance again after each step. Works in a band of five voxels, or the solid's own if
/// that is wider.
/// @return the number of steps
std::size_t advectSemiLagrangian(NarrowBand& band, const TimeInterval& interval);

/// HJ-WENO5 with TVD-RK3, a signed distance again whenever the surface has moved a voxel and a
/// half.
/// @return the number of steps, as the CFL condition makes them
std::size_t advectUpwind(NarrowBand& band, const TimeInterval& interval);

}  // namespace levelset::flow
