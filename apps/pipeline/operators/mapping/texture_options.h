#pragma once

#include <Imath/ImathBox.h>

#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "mapping/textures/geometric_texture.h"
#include "mapping/textures/mesh_texture.h"

/// Parameters that `texture` and `animate` share. The first operands of these actions are base,
/// texture and patch.
namespace pipeline {

[[nodiscard]] std::vector<Param> textureParams();
/// @throws levelset::UsageError for options that exclude each other or do not fit the texture
void validateTextureOptions(const Invocation& in);
/// Returns true if vertices of a mesh are moved: for --map mesh, and for --map shell with a mesh.
[[nodiscard]] bool mapsMesh(const Invocation& in);
/// Returns --texture-box, or the bounds of the texture.
[[nodiscard]] Imath::Box3d textureBoxOf(const Invocation& in);
/// Returns the patches, rebuilt at the height that the texture needs under --height auto. Adds a
/// note with that height.
[[nodiscard]] std::vector<mapping::Patch> patchesAtHeight(Invocation& in, const PatchValue& onto,
                                                          const Imath::Box3d& textureBox);
// These functions read the options of the mapping. The caller sets the progress callback.
[[nodiscard]] mapping::TextureOptions textureOptions(Invocation& in);
[[nodiscard]] mapping::MeshTextureOptions meshTextureOptions(Invocation& in);
[[nodiscard]] Plan planTexture(Invocation& in);

}  // namespace pipeline
