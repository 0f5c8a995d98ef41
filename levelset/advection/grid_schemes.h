#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/advection/time_interval.h"
#include "levelset/narrow_band.h"

namespace levelset::flow {

/// Moves a band over the time interval with the semi-Lagrangian scheme. Interpolates φ tricubically
/// at the feet of backward characteristics, and redistances after each step. Works in a band of
/// five voxels, or in the solid's own band if that is wider.
/// @return the number of steps
std::size_t advectSemiLagrangian(NarrowBand& band, const TimeInterval& interval);

/// Moves a band over the time interval with HJ-WENO5 and TVD-RK3. Redistances whenever the surface
/// has moved a voxel and a half.
/// @return the number of steps, which the CFL condition determines
std::size_t advectUpwind(NarrowBand& band, const TimeInterval& interval);

}  // namespace levelset::flow
