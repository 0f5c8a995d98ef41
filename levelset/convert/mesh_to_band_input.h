#pragma once

#include <cstddef>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/mesh_sign/local_mesh.h"

namespace levelset::convert {

/// What meshToBand refuses before it starts, in the order: the call, the mesh, the index range, the
/// memory, the precision of the coordinates.
/// @param action  begins the message
/// @throws UsageError, InvalidInput, ResourceLimit
void checkMeshInput(const TriMesh& mesh, double voxelSize, const MeshToBandOptions& options,
                    const char* action = "level-set");

/// The grid point, of coordinates that 8 divides, nearest below the middle of the mesh.
[[nodiscard]] Imath::V3i localOrigin(const TriMesh& mesh, double voxelSize);

/// The welded faces in voxels about `origin`.
[[nodiscard]] LocalMesh toLocal(const TriMesh& mesh, const MeshTopology& topology, double voxelSize,
                                const Imath::V3i& origin);

}  // namespace levelset::convert
