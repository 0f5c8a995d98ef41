#pragma once

#include <cstddef>
#include <optional>

#include "levelset/convert/distance_method.h"
#include "levelset/mesh_sign/sign_field.h"
#include "levelset/vdb.h"

namespace levelset::convert {

/// Computes distances and signs in all blocks within `halfWidth` voxels of the surface and
/// assembles them into a tree.
/// @param method   algorithm of the distances; both give the same values
/// @param region   index box of the blocks to compute; empty: all blocks. Tiles that do not
///                 intersect it are set to outside
/// @param surface  mesh, with the surfaces that span its holes, in voxels relative to `origin`
/// @param field    winding numbers that give the signs, in the same frame
/// @param origin   index coordinates of the origin of `surface`
/// @return level set with a leaf for each block with active voxels, and tiles of the correct sign
///         elsewhere
[[nodiscard]] openvdb::FloatGrid::Ptr assembleBand(const LocalMesh& surface, const SignField& field,
                                                   const Imath::V3i& origin, double voxelSize,
                                                   double halfWidth, DistanceMethod method,
                                                   const std::optional<openvdb::CoordBBox>& region,
                                                   std::size_t maxMemory, const Progress& progress);

/// Returns the fraction of grid points with an ambiguous winding number w, |w − 1/2| < 1/4, among
/// the active points with a neighbour of the opposite sign. Returns 0 for a closed surface, and 1
/// if no active point has such a neighbour.
[[nodiscard]] double ambiguousShare(const openvdb::FloatGrid& grid, const SignField& field,
                                    const Imath::V3i& origin);

}  // namespace levelset::convert
