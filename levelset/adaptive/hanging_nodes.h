#pragma once

// Internal header of levelset: public headers must not include it.

#include <vector>

#include "levelset/adaptive/adaptive_tree.h"

namespace levelset {

/// Returns values that make the field of a tree continuous. A corner that lies on a face or an edge
/// of a larger leaf gets the interpolated value of that leaf [Sigg06, 3.4.1]. Blocks that share a
/// corner get the same bits.
[[nodiscard]] std::vector<CornerValues> continuousValues(const AdaptiveTree& tree);

}  // namespace levelset
