#pragma once

// Internal header of levelset: public headers must not include it.

#include <functional>

#include "levelset/vdb.h"

namespace levelset::eikonal {

/// Writes ± background into `result` with the signs of the tiles of `field`.
void copyTileSigns(const openvdb::FloatTree& field, openvdb::FloatTree& result);
/// Writes ± background into `result` with the signs of a leaf.
void copyLeafSigns(const openvdb::FloatTree::LeafNodeType& leaf, openvdb::FloatTree& result);

/// Writes ± background into `result` with the signs of `field`. Skips the leaf blocks for which
/// holds(origin) returns true: the caller writes their values.
void copySigns(const openvdb::FloatTree& field,
               const std::function<bool(const openvdb::Coord& origin)>& holds,
               openvdb::FloatTree& result);

}  // namespace levelset::eikonal
