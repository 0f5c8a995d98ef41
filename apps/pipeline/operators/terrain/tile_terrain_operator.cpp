#include <fmt/core.h>

#include <filesystem>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/tiled_terrain.h"
#include "apps/pipeline/operators/volume_params.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "levelset/file_target.h"
#include "levelset/terrain/files/height_field_file.h"
#include "levelset/terrain/files/height_rows.h"
#include "levelset/terrain/tiles/tiled_ground.h"

namespace pipeline {
namespace {

using levelset::UsageError;

/// Options that describe a .raw file.
std::vector<Param> rawHeightParams() {
  std::vector<Param> params;
  for (Param& param : volumeFileParams())
    if (param.name != "frame") params.push_back(std::move(param));
  for (Param& param : params)
    if (param.name == "type") std::erase(param.choices, "f16");  // heights have no use for it
  params.push_back({.name = "no-data",
                    .type = ParamType::Number,
                    .doc = "for .raw: samples of this height have no data"});
  params.push_back({.name = "flip",
                    .type = ParamType::Flag,
                    .doc = "for .raw: the first row is the northernmost one"});
  return params;
}

/// Description of a .raw file by the options.
levelset::RawHeights rawHeights(const Invocation& in) {
  const levelset::RawLayout layout = *volumeOptions(in).raw;
  if (layout.size.z != 1)
    throw UsageError(
        fmt::format("tile-terrain: --size has {} layers, but a terrain has one; give "
                    "W,H,1",
                    layout.size.z));
  levelset::RawHeights raw{.columns = layout.size.x,
                           .rows = layout.size.y,
                           .type = layout.type,
                           .isBigEndian = layout.isBigEndian,
                           .isNorthFirst = in.flag("flip"),
                           .skip = layout.skip,
                           .origin = {layout.origin.x, layout.origin.y},
                           .spacing = {layout.spacing.x, layout.spacing.y},
                           .maxMemory = in.maxMemory};
  if (in.given("no-data")) raw.noData = in.number("no-data");
  return raw;
}

std::unique_ptr<levelset::HeightRows> rowsIn(const Invocation& in) {
  if (levelset::isRawFormat(formatName(in)))
    return levelset::openRawHeightRows(in.text("file"), rawHeights(in));
  return levelset::openHeightRows(
      in.text("file"),
      {.format = in.given("format") ? in.text("format") : "", .maxMemory = in.maxMemory});
}

Value tileTerrain(Invocation& in) {
  const std::unique_ptr<levelset::HeightRows> rows = rowsIn(in);
  levelset::writeTiledGround(in.text("to"), *rows, tiledWriteOptions(in));
  Json json;
  addTiledTerrain(json, in.text("to"), in.maxMemory);
  in.notes.detailsJson = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  return Value(Plan{});
}

void validateTiling(const Invocation& in) {
  const std::string name = formatName(in);
  const bool isRaw = levelset::isRawFormat(name);
  if (!isRaw && !levelset::isRowFormat(name))
    throw UsageError(fmt::format(
        "tile-terrain: '{}' is of no format that is read by rows; use asc, hgt, flt, bil or raw",
        name));
  if (in.text("file") == "-" && !levelset::isAsciiGridFormat(name))
    throw UsageError(
        "tile-terrain: only the format asc can be read from standard input; give a file, not -");
  if (!levelset::isTiledGroundFormat(in.text("to")))
    throw UsageError(fmt::format(
        "tile-terrain: '{}' is no name of a tiled terrain; give a name that ends in .lst",
        in.text("to")));
  if (levelset::isSameFile(in.text("file"), in.text("to")))
    throw UsageError("tile-terrain: both files are the same; give another name");
  for (const Param& param : rawHeightParams())
    if (in.given(param.name) && !isRaw)
      throw UsageError(
          fmt::format("tile-terrain: --{} describes a .raw file, and this one has a header; leave "
                      "it out",
                      param.name));
  if (isRaw && (!in.given("size") || !in.given("type")))
    throw UsageError("tile-terrain: a .raw file has no header; give --size and --type");
  if (isRaw) static_cast<void>(rawHeights(in));
}

}  // namespace

Operator tileTerrainOperator() {
  Operator op{
      .name = "tile-terrain",
      .group = "Terrain",
      .summary = "convert a terrain of any size into a tiled file (lst), row by row",
      .details =
          "The terrain is never in memory as a whole: it takes about four rows of patches, and 110 "
          "bytes for each patch. The file has the patches of all levels of a pyramid, their ranges "
          "and errors. 'read' reads it, or a part of it with --box and --level. With --tolerance, "
          "each stored height is within the tolerance of the true one, and the tolerance is part "
          "of all errors.",
      .example =
          "levelsmith tile-terrain <(printf 'ncols 3\\nnrows 3\\nxllcorner 0\\nyllcorner "
          "0\\ncellsize 1\\n0 1 0\\n1 2 1\\n0 1 0\\n') --format asc small.lst",
      .params = {{.name = "file",
                  .type = ParamType::Path,
                  .doc = "file to read: asc, hgt, flt, bil or raw; or - for standard input",
                  .required = true,
                  .position = 0},
                 {.name = "to",
                  .type = ParamType::Path,
                  .doc = "file to write; its name ends in .lst",
                  .required = true,
                  .position = 1},
                 {.name = "format",
                  .type = ParamType::Text,
                  .doc = "format of the file to read; default: by its extension"}},
      .isRepeatable = false,
      .flow = Flow::PassesThrough,
      .run = tileTerrain,
      .plan = [](Invocation&) { return Plan{}; },
      .validate = validateTiling,
      .targets = [](const Invocation& in) { return std::vector{in.text("to")}; },
      .usesStandardInput = [](const Invocation& in) { return in.text("file") == "-"; },
  };
  for (Param& param : tiledWriteParams()) op.params.push_back(std::move(param));
  for (Param& param : rawHeightParams()) op.params.push_back(std::move(param));
  return op;
}

}  // namespace pipeline
