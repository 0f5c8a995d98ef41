#pragma once

#include <Imath/ImathVec.h>

#include <vector>

#include "levelset/mesh.h"
#include "render/gpu/device/gl_context.h"

namespace render {

/// Signed distances of the 8³ blocks of grid points near a mesh, in voxels.
struct BlockDistances {
  static constexpr std::size_t kPoints = 512;

  std::vector<Imath::V3i> origins;  ///< lowest grid point of each block, ascending by x, y and z
  /// kPoints numbers for each block, x slowest, z fastest, negative behind the triangles. Points
  /// beyond the half width have the half width.
  std::vector<float> distances;
};

/// Computes the signed distances from a closed, consistently oriented mesh in a compute shader, by
/// scan conversion of prisms [Sigg06, 4.2]. The processor lists the prisms that touch each block.
/// The sign is that of the pseudonormal at the closest point [Baerentzen05]: negative behind the
/// triangles, whatever the nesting. The shader computes in double precision. Distances differ from
/// those of levelset::meshToBand() by at most 2 units in the last place. So do the signed ones of a
/// mesh that faces outwards and has no part inside another.
/// @param voxelSize  world units, positive; grid points lie at its integer multiples
/// @param halfWidth  largest distance, voxels, at least 1
/// @throws levelset::InvalidInput for a mesh with a border, an edge of three faces, or faces of
///         opposite orientations at an edge; and for a mesh that meshToBand() refuses
/// @throws levelset::UsageError for a voxel size or half width out of range
/// @throws levelset::ResourceLimit when the memory of the graphics driver does not suffice
[[nodiscard]] BlockDistances prismDistances(const GlContext& context, const levelset::TriMesh& mesh,
                                            double voxelSize, double halfWidth);

}  // namespace render
