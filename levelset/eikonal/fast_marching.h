#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/eikonal/arrival_blocks.h"

namespace levelset::eikonal {

/// Fast marching: accepts grid points one by one in the order of their times [Sethian99]. Runs on
/// one thread.
/// @param order  1 or 2: order of the upwind differences
void marchArrivals(ArrivalBlocks& blocks, int order);

}  // namespace levelset::eikonal
