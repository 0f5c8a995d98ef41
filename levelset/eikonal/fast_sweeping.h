#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/eikonal/arrival_blocks.h"

namespace levelset::eikonal {

/// Fast sweeping: solves block by block until no time changes [Zhao05]. Runs in parallel.
/// With order 2 it then solves once more with second-order differences, on the upwind side that the
/// first-order solution found.
/// @param order  1 or 2: order of the upwind differences
void sweepArrivals(ArrivalBlocks& blocks, int order);

}  // namespace levelset::eikonal
