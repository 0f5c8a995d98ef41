#pragma once

#include <Imath/ImathBox.h>

#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "mapping/textures/geometric_texture.h"
#include "mapping/textures/mesh_texture.h"

/// What the actions that map a texture have in common. Their operands begin with base, texture and
/// patch.
namespace pipeline {

[[nodiscard]] std::vector<Param> textureParams();
/// @throws levelset::UsageError for options that exclude each other or do not fit the texture
void validateTextureOptions(const Invocation& in);
/// With --map mesh: the texture and the result are meshes.
[[nodiscard]] bool mapsMesh(const Invocation& in);
/// --texture-box, or the box of the texture.
[[nodiscard]] Imath::Box3d textureBoxOf(const Invocation& in);
/// The patches at the height that the texture asks for, under --height auto; told in the notes.
[[nodiscard]] std::vector<mapping::Patch> patchesAtHeight(Invocation& in, const PatchValue& onto,
                                                          const Imath::Box3d& textureBox);
// All but the progress.
[[nodiscard]] mapping::TextureOptions textureOptions(Invocation& in);
[[nodiscard]] mapping::MeshTextureOptions meshTextureOptions(Invocation& in);
[[nodiscard]] Plan planTexture(Invocation& in);

}  // namespace pipeline
