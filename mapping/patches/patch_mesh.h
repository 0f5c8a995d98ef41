#pragma once

#include "levelset/mesh.h"
#include "mapping/patches/patch.h"

namespace mapping {

enum class PatchMeshKind {
  Solid,  ///< bottom, top and the four sides: one closed mesh that faces outwards, a solid's
          ///< surface
  Sheets  ///< each layer by itself, as it is
};

/// Patch space as a mesh, to look at: particles are its vertices, each cell of four is two
/// triangles. The sides of a shell join the borders of all layers.
/// @pre two layers or more
[[nodiscard]] levelset::TriMesh patchMesh(const Patch& patch,
                                          PatchMeshKind kind = PatchMeshKind::Solid);

}  // namespace mapping
