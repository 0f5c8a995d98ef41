#pragma once

#include <cstddef>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/mesh_sign/local_mesh.h"

namespace levelset::convert {

/// Checks the input of meshToBand, in this order: the arguments, the mesh, the index range, the
/// memory, the precision of the coordinates.
/// @throws UsageError, InvalidInput, ResourceLimit
void checkMeshInput(const TriMesh& mesh, double voxelSize, const MeshToBandOptions& options);

/// Grid point just below the centre of the mesh. Its coordinates are multiples of 8.
[[nodiscard]] Imath::V3i localOrigin(const TriMesh& mesh, double voxelSize);

/// The welded faces, in voxels relative to `origin`.
[[nodiscard]] LocalMesh toLocal(const TriMesh& mesh, const MeshTopology& topology, double voxelSize,
                                const Imath::V3i& origin);

}  // namespace levelset::convert
