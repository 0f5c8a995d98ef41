#include "apps/pipeline/operators/terrain/terrain_pictures.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "levelset/error.h"
#include "render/terrain/rays/terrain_part.h"

namespace pipeline {

using levelset::UsageError;

std::vector<Param> terrainPictureParams() {
  return {{.name = "outside",
           .type = ParamType::Box,
           .doc = "for a terrain: leave out the ground in this box, for a solid that replaces it; "
                  "the cells at the walls of the box stay, so that both overlap"},
          {.name = "facets",
           .type = ParamType::Flag,
           .doc = "for a terrain: shade with the normals of the triangles; default: normals from "
                  "differences of the heights"}};
}

void validateTerrainPicture(const Invocation& in) {
  if (in.operands.empty()) return;
  const bool hasTerrain =
      std::any_of(in.operands.begin(), in.operands.end(),
                  [](const Value& operand) { return operand.plan().kind == Kind::Terrain; });
  for (const Param& param : terrainPictureParams())
    if (in.given(param.name) && !hasTerrain)
      throw UsageError(
          fmt::format("{}: --{} is for terrains; leave it out", in.op().name, param.name));
}

render::TerrainPart terrainPartOf(Invocation& in, std::size_t operand) {
  render::TerrainOptions options{.isSmooth = !in.flag("facets"), .maxBytes = in.maxMemory};
  if (in.given("outside")) options.outside = in.box("outside");
  return {.caster = render::TerrainCaster(in.operands[operand].sharedTerrain(), options),
          .name = "terrain"};
}

render::ViewedScene terrainScene(Invocation& in) {
  render::ViewedScene viewed;
  viewed.scene.terrains.push_back(terrainPartOf(in, 0));
  return viewed;
}

}  // namespace pipeline
