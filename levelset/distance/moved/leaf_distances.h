#pragma once

// Internal header of levelset: public headers must not include it.

#include <utility>
#include <vector>

#include "levelset/vdb.h"

namespace levelset::eikonal {

/// Signed distances of grid points of one leaf, voxels, by their numbers in the leaf.
using LeafDistances = std::vector<std::pair<openvdb::Index, double>>;

/// Sets some distances of the leaf at `origin`; makes the leaf if it does not exist.
/// @param halfWidth  voxels
void setAll(openvdb::FloatGrid& field, const openvdb::Coord& origin, const LeafDistances& values,
            double halfWidth);

[[nodiscard]] std::vector<const openvdb::MaskTree::LeafNodeType*> leavesOf(
    const openvdb::MaskTree& tree);

/// Returns the grid points within `reach` voxels of one of `points` along each axis.
[[nodiscard]] openvdb::MaskTree boxesAround(const openvdb::MaskTree& points, double reach);

}  // namespace levelset::eikonal
