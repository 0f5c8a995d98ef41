#pragma once

#include <string>
#include <vector>

#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/terrain/tiles/write_tiled_ground.h"

// Tiled terrain files (.lst) of the actions read, write, info and tile-terrain.

namespace pipeline {

/// Options of `read` for tiled terrains.
[[nodiscard]] std::vector<Param> tiledReadParams();
/// Options of actions that write tiled terrains.
[[nodiscard]] std::vector<Param> tiledWriteParams();
/// Refuses options for tiled terrains on other files. @throws UsageError
void checkTiledOptions(const Invocation& in, const std::vector<Param>& params, bool isTiled);

/// Reads the terrain, or the part and level of it that the options name.
[[nodiscard]] Value readTiledTerrain(Invocation& in);
/// Plans the result of readTiledTerrain() from the index of the file.
[[nodiscard]] Plan planTiledTerrain(Invocation& in);

[[nodiscard]] levelset::WriteTilesOptions tiledWriteOptions(const Invocation& in);

/// Adds what the index of a file says to a JSON object.
void addTiledTerrain(Json& json, const std::string& file, std::size_t maxMemory);

}  // namespace pipeline
