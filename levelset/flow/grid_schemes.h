#pragma once

// For the .cpp files of levelset/flow only.

#include "levelset/flow/front.h"
#include "levelset/narrow_band.h"

namespace levelset::flow {

/// φ at the feet of backward characteristics (classical Runge-Kutta), interpolated tricubically;
/// a signed distance again after each step.
/// @return the number of steps
std::size_t carryBySemiLagrange(NarrowBand& band, const Journey& journey);

/// OpenVDB's HJ-WENO5 with TVD-RK3; its own normalisation after each step, our re-distancing at the
/// end.
/// @return the number of steps, as its CFL condition makes them
std::size_t carryUpwind(NarrowBand& band, const Journey& journey);

}  // namespace levelset::flow
