#pragma once

#include <cstddef>
#include <optional>

#include "levelset/mesh_sign/sign_field.h"
#include "levelset/vdb.h"

namespace levelset::convert {

/// Computes distances and signs of all blocks within `halfWidth` of the mesh and assembles the
/// tree.
/// @param region  index box of the blocks to compute; empty: all blocks. Tiles that do not meet the
///         region are outside
/// @param surface  the mesh and the other surfaces that bound the solid, in voxels relative to
///         `origin`
/// @return a level set with leaves where there are active voxels, and tiles of the correct sign
///         elsewhere
[[nodiscard]] openvdb::FloatGrid::Ptr assembleBand(const LocalMesh& surface, const SignField& field,
                                                   const Imath::V3i& origin, double voxelSize,
                                                   double halfWidth,
                                                   const std::optional<openvdb::CoordBBox>& region,
                                                   std::size_t maxMemory, const Progress& progress);

/// Share of ambiguous grid points, |w − 1/2| < 1/4, among those with a neighbour of opposite sign.
/// 0 for a closed surface, 1 where there are no such points.
[[nodiscard]] double ambiguousShare(const openvdb::FloatGrid& grid, const SignField& field,
                                    const Imath::V3i& origin);

}  // namespace levelset::convert
