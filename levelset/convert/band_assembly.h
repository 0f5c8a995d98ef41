#pragma once

#include <cstddef>
#include <optional>

#include "levelset/mesh_sign/sign_field.h"
#include "levelset/vdb.h"

namespace levelset::convert {

/// Measures and signs every block within reach of the mesh and puts the tree together.
/// @param region   the blocks that are measured; empty: all. Tiles that meet none are outside
/// @param surface  the mesh, and whatever else bounds the solid, in voxels about `origin`
/// @return a level set with leaves where there are active voxels, and tiles of the right sign
[[nodiscard]] openvdb::FloatGrid::Ptr assembleBand(const LocalMesh& surface, const SignField& field,
                                                   const Imath::V3i& origin, double voxelSize,
                                                   double halfWidth,
                                                   const std::optional<openvdb::CoordBBox>& region,
                                                   std::size_t maxMemory, const Progress& progress);

/// Of the grid points with a neighbour of opposite sign, the share with |w − 1/2| < 1/4.
/// 0 for a closed surface, 1 where there are no such points.
[[nodiscard]] double ambiguousShare(const openvdb::FloatGrid& grid, const SignField& field,
                                    const Imath::V3i& origin);

}  // namespace levelset::convert
