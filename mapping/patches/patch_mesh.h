#pragma once

#include "levelset/mesh.h"
#include "mapping/patches/patch.h"

namespace mapping {

enum class PatchMeshKind {
  Solid,  ///< one closed mesh that faces outwards: bottom, top and the four sides
  Sheets  ///< each layer as an open mesh
};

/// Builds a mesh of the space above a patch, for display. Particles are its vertices, and each cell
/// of four particles is two triangles. The sides of a Solid connect the borders of all layers.
/// @pre two layers or more
[[nodiscard]] levelset::TriMesh patchMesh(const Patch& patch,
                                          PatchMeshKind kind = PatchMeshKind::Solid);

}  // namespace mapping
