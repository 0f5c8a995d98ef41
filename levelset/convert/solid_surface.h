#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <cstddef>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/mesh_sign/local_mesh.h"
#include "levelset/mesh_sign/sign_field.h"

namespace levelset::convert {

/// Surface of the solid that a mesh describes, and the rule for its inside.
struct SolidSurface {
  Imath::V3i origin;  ///< origin of the local frame, voxels
  /// Triangles between inside and outside, but for the surface that spans holes. With crossing
  /// parity, all triangles, as they are oriented in the input.
  LocalMesh mesh;
  SignField field;
  SignCertificate certificate;  ///< without ambiguousShare
};

/// Chooses the method of signs, and finds the triangles that separate inside from outside.
/// @param voxelSize  unit of the local frame, world units
/// @throws InvalidInput for a mesh without area, and as the method of signs demands
[[nodiscard]] SolidSurface solidSurface(const TriMesh& mesh, double voxelSize,
                                        const MeshToBandOptions& options, const Progress& progress);

/// Adds to the mesh of an open surface the triangles that span its holes: the part of the boundary
/// between inside and outside that is not on the mesh.
/// @param reach  distance from the mesh within which a hole is noticed, voxels
/// @throws ResourceLimit, Cancelled
void addOpenSurface(SolidSurface& surface, double reach, std::size_t maxMemory,
                    const Progress& progress);

}  // namespace levelset::convert
