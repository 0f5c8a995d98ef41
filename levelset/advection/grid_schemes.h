#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/advection/time_interval.h"
#include "levelset/hamilton_jacobi/upwind_derivative.h"
#include "levelset/narrow_band.h"
#include "levelset/vdb.h"

namespace levelset::flow {

/// Moves a band over the time interval with the semi-Lagrangian scheme. Interpolates φ tricubically
/// at the feet of backward characteristics, and redistances after each step. Works in a band with a
/// half width of five voxels, or of the solid's half width if that is larger.
/// @return the number of steps
std::size_t advectSemiLagrangian(NarrowBand& band, const TimeInterval& interval);

/// Computes one step of the upwind scheme on the active grid points, without redistancing: an Euler
/// step, or a TVD Runge-Kutta step of second or third order [Shu88].
[[nodiscard]] openvdb::FloatGrid::Ptr upwindStep(const openvdb::FloatGrid& start,
                                                 const TimeInterval& interval,
                                                 const UpwindOrders& orders, double from,
                                                 double to);

/// Moves a band over the time interval with upwind differences. Redistances whenever the surface
/// has moved 1.5 voxels.
/// @return the number of steps, which the CFL condition determines
std::size_t advectUpwind(NarrowBand& band, const TimeInterval& interval,
                         const UpwindOrders& orders);

}  // namespace levelset::flow
