#pragma once

#include <cstddef>
#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/registry/operator.h"
#include "render/views/scene_file.h"

/// The parts of the operators `render` and `scene` that concern terrains.
namespace pipeline {

/// Options --outside and --facets.
[[nodiscard]] std::vector<Param> terrainPictureParams();
/// Refuses these options without an operand that is a terrain.
/// @throws UsageError
void validateTerrainPicture(const Invocation& in);
/// Part of a scene with the ground of a terrain, which it shares.
/// @param operand  number of the operand
/// @throws as render::TerrainCaster
[[nodiscard]] render::TerrainPart terrainPartOf(Invocation& in, std::size_t operand);
/// Scene with the terrain of the first operand.
[[nodiscard]] render::ViewedScene terrainScene(Invocation& in);

}  // namespace pipeline
