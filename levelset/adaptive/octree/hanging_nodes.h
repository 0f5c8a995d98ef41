#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstdint>
#include <vector>

#include "levelset/adaptive/octree/adaptive_tree.h"

namespace levelset {

/// Returns values, and gradients if the tree has them, that make its field continuous. A corner
/// that lies on a face or an edge of a larger leaf gets the interpolated ones of that leaf
/// [Sigg06, 3.4.1]. Blocks that share a corner get the same bits for its value. Gradients may
/// differ: a leaf gets the derivatives that its faces have in common with larger leaves.
[[nodiscard]] CornerData continuousData(const AdaptiveTree& tree);

/// Updates these data after leaves of the tree were split.
/// @param first  number of the first new block
/// @param data  data of the tree before; gets those of the new blocks too
/// @return the blocks whose data may have changed, ascending
std::vector<std::uint32_t> updateData(const AdaptiveTree& tree, std::uint32_t first,
                                      CornerData& data);

}  // namespace levelset
