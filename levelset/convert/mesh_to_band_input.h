#pragma once

#include <cstddef>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/mesh_sign/local_mesh.h"

namespace levelset::convert {

/// Checks that a mesh has triangles, and that its coordinates are finite and its indices in range.
/// @throws InvalidInput
void checkElements(const TriMesh& mesh);

/// Checks the input of meshToBand, in this order: the voxel size and half width, the vertices and
/// triangles, the voxel size against the size of the mesh, the index range, the memory, the
/// precision of the coordinates.
/// @throws UsageError, InvalidInput, ResourceLimit
void checkMeshInput(const TriMesh& mesh, double voxelSize, const MeshToBandOptions& options);

/// Returns the origin of the local frame of a mesh, in index coordinates: the centre of the mesh,
/// rounded down to multiples of 8.
[[nodiscard]] Imath::V3i localOrigin(const TriMesh& mesh, double voxelSize);

/// Returns the mesh in voxels relative to `origin`, with the triangles of `topology`: vertices at
/// equal positions are merged, degenerate and duplicate triangles are dropped.
[[nodiscard]] LocalMesh toLocal(const TriMesh& mesh, const MeshTopology& topology, double voxelSize,
                                const Imath::V3i& origin);

}  // namespace levelset::convert
