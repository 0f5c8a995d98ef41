#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstdint>
#include <vector>

#include "levelset/adaptive/octree/adaptive_tree.h"

namespace levelset {

/// Returns values that make the field of a tree continuous. A corner that lies on a face or an edge
/// of a larger leaf gets the interpolated value of that leaf [Sigg06, 3.4.1]. Blocks that share a
/// corner get the same bits.
[[nodiscard]] std::vector<CornerValues> continuousValues(const AdaptiveTree& tree);

/// Updates these values after leaves of the tree were split.
/// @param first  number of the first new block
/// @param values  values of the tree before; gets those of the new blocks too
/// @return the blocks whose values may have changed, ascending
std::vector<std::uint32_t> updateValues(const AdaptiveTree& tree, std::uint32_t first,
                                        std::vector<CornerValues>& values);

}  // namespace levelset
