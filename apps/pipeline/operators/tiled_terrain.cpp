#include "apps/pipeline/operators/tiled_terrain.h"

#include <fmt/core.h>

#include <cmath>

#include "levelset/error.h"
#include "levelset/terrain/tiles/read_ground.h"
#include "levelset/terrain/tiles/tiled_ground.h"

namespace pipeline {
namespace {

levelset::ReadGroundOptions groundOptions(const Invocation& in) {
  levelset::ReadGroundOptions options{.maxMemory = in.maxMemory, .progress = in.progress};
  if (in.given("box")) options.box = in.box("box");
  if (in.given("level")) options.level = in.integerAs<int>("level");
  return options;
}

}  // namespace

std::vector<Param> tiledReadParams() {
  return {{.name = "box",
           .type = ParamType::Box,
           .doc = "for .lst: read the samples in this box; its z is ignored"},
          {.name = "level",
           .type = ParamType::Integer,
           .doc = "for .lst: read every 2^N-th sample; default: 0",
           .range = Range::NonNegative}};
}

std::vector<Param> tiledWriteParams() {
  return {{.name = "tolerance",
           .type = ParamType::Number,
           .doc = "for .lst: largest distance between a stored height and the true one; default: "
                  "heights keep their bits",
           .range = Range::Positive},
          {.name = "cells",
           .type = ParamType::Integer,
           .doc = "for .lst: cells along a side of a patch, a power of two from 2 to 128; default: "
                  "64",
           .range = Range::Positive}};
}

void checkTiledOptions(const Invocation& in, const std::vector<Param>& params, bool isTiled) {
  for (const Param& param : params)
    if (in.given(param.name) && !isTiled)
      throw levelset::UsageError(fmt::format("{}: --{} is for tiled terrains, .lst; leave it out",
                                             in.op().name, param.name));
}

Value readTiledTerrain(Invocation& in) {
  const auto tiles = levelset::openTiledGround(in.text("file"), in.maxMemory);
  levelset::HeightField terrain = levelset::readGround(*tiles, groundOptions(in));
  if (const std::size_t missing = terrain.missingCount(); missing > 0)
    in.notes.notes.push_back(fmt::format("{}: {} of {} samples have no data", in.text("file"),
                                         missing, terrain.heights.size()));
  return Value(std::move(terrain));
}

Plan planTiledTerrain(Invocation& in) {
  const levelset::TiledGroundInfo info = levelset::tiledGroundInfo(in.text("file"), in.maxMemory);
  const levelset::HeightField grid = levelset::groundGrid(info.layout, groundOptions(in));
  levelset::requireGroundMemory(grid, in.maxMemory);
  Plan plan{.kind = Kind::Terrain, .samples = {grid.columns, grid.rows}};
  plan.fieldBytes = static_cast<double>(grid.columns) * grid.rows * sizeof(float);
  const levelset::PyramidPatch& top = info.layout.pyramid.levels.back().patches[0];
  if (std::isnan(top.lowest)) return plan;
  const Imath::V2d low = grid.position(0, 0), high = grid.position(grid.columns - 1, grid.rows - 1);
  plan.bounds.extendBy(Imath::V3d(low.x, low.y, static_cast<double>(top.lowest)));
  plan.bounds.extendBy(Imath::V3d(high.x, high.y, static_cast<double>(top.highest)));
  return plan;
}

levelset::WriteTilesOptions tiledWriteOptions(const Invocation& in) {
  levelset::WriteTilesOptions options{.maxMemory = in.maxMemory, .progress = in.progress};
  if (in.given("cells")) options.cells = in.integerAs<int>("cells");
  if (in.given("tolerance")) options.tolerance = in.number("tolerance");
  return options;
}

void addTiledTerrain(Json& json, const std::string& file, std::size_t maxMemory) {
  const levelset::TiledGroundInfo info = levelset::tiledGroundInfo(file, maxMemory);
  const levelset::GroundLayout& layout = info.layout;
  json["columns"] = layout.columns;
  json["rows"] = layout.rows;
  json["origin"] = Json::array({layout.origin.x, layout.origin.y});
  json["spacing"] = Json::array({layout.spacing.x, layout.spacing.y});
  const levelset::PyramidPatch& top = layout.pyramid.levels.back().patches[0];
  json["range"] = std::isnan(top.lowest) ? Json() : Json::array({top.lowest, top.highest});
  if (!layout.coordinateSystem.empty()) json["coordinate_system"] = layout.coordinateSystem;
  json["geographic"] = layout.isGeographic;
  json["cells"] = layout.pyramid.cells;
  json["tolerance"] = info.tolerance;
  json["bytes"] = info.fileBytes;
  json["index_bytes"] = info.indexBytes;
  // The ratio counts the floats of the finest level.
  json["ratio"] = static_cast<double>(layout.columns) * layout.rows * sizeof(float) /
                  static_cast<double>(info.fileBytes);
  json["hash"] = fmt::format("{:016x}", info.hash);
  json["levels"] = Json::array();
  for (std::size_t n = 0; n < info.levels.size(); ++n) {
    const levelset::PyramidLevel& level = layout.pyramid.levels[n];
    float bound = 0;
    for (const levelset::PyramidPatch& patch : level.patches) bound = std::fmax(bound, patch.bound);
    json["levels"].push_back({{"level", n},
                              {"patches", Json::array({level.columns, level.rows})},
                              {"known", info.levels[n].known},
                              {"bytes", info.levels[n].bytes},
                              {"error", std::isinf(bound) ? Json() : Json(bound)}});
  }
}

}  // namespace pipeline
