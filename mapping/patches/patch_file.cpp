#include "mapping/patches/patch_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>

#include "levelset/error.h"
#include "levelset/file_target.h"
#include "levelset/files/json_text.h"
#include "levelset/progress.h"

namespace mapping {
namespace {

using Imath::V3d;
using levelset::InvalidInput;
using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "levelsmith patches";
constexpr int kVersion = 1;
constexpr std::array<const char*, 3> kSchemeNames = {"reduced", "conforming", "spline"};

Json toJson(const V3d& p) {
  if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
    throw InvalidInput(
        fmt::format("a particle of the patch at ({}, {}, {}) is not finite; build the patch again",
                    p.x, p.y, p.z));
  }
  return {p.x, p.y, p.z};
}

Json toJson(std::span<const V3d> points) {
  Json json = Json::array();
  for (const V3d& p : points) json.push_back(toJson(p));
  return json;
}

void requireFinite(double value, const char* what) {
  if (!std::isfinite(value)) {
    throw InvalidInput(
        fmt::format("the {} of the patch is {}; build the patch again", what, value));
  }
}

Json toJson(const Patch& patch) {
  requireFinite(patch.height, "height");
  requireFinite(patch.spacing, "spacing");
  Json json;
  json["corners"] = toJson(patch.corners);
  json["height"] = patch.height;
  json["mirrored"] = patch.mirrored;
  json["spacing"] = patch.spacing;
  if (patch.scheme) json["scheme"] = kSchemeNames[static_cast<std::size_t>(*patch.scheme)];
  json["levels"] = Json::array();
  for (const ParticleLayer& layer : patch.layers) {
    requireFinite(layer.w, "w of a layer");
    requireFinite(layer.height, "height of a layer");
    Json entry;
    entry["columns"] = layer.columns;
    entry["rows"] = layer.rows;
    entry["w"] = layer.w;
    entry["height"] = layer.height;
    entry["positions"] = toJson(layer.positions);
    entry["rim"] = toJson(layer.rim);
    json["levels"].push_back(std::move(entry));
  }
  return json;
}

/// Reads the values of a JSON document. Messages name the part of the document, such as "patch 0,
/// layer 1".
class Reader {
 public:
  explicit Reader(std::string file) : file_(std::move(file)) {}

  [[noreturn]] void refuse(const std::string& where, const std::string& what) const {
    throw InvalidInput(fmt::format("{}: {} {}; write the patch again", file_, where, what));
  }

  [[nodiscard]] const Json& member(const Json& json, const char* name,
                                   const std::string& where) const {
    if (!json.is_object() || !json.contains(name))
      refuse(where, fmt::format("has no \"{}\"", name));
    return json.at(name);
  }

  [[nodiscard]] double number(const Json& json, const char* name, const std::string& where) const {
    const Json& value = member(json, name, where);
    if (!value.is_number() || !std::isfinite(value.get<double>()))
      refuse(where, fmt::format("has a \"{}\" that is not a finite number", name));
    return value.get<double>();
  }

  [[nodiscard]] std::size_t count(const Json& json, const char* name,
                                  const std::string& where) const {
    const double value = number(json, name, where);
    if (!(value >= 2) || value > 1e6 || value != std::floor(value))
      refuse(where, fmt::format("has {} {}, not an integer from 2 to 1000000", value, name));
    return static_cast<std::size_t>(value);
  }

  [[nodiscard]] std::vector<V3d> points(const Json& json, const char* name,
                                        const std::string& where) const {
    const Json& list = member(json, name, where);
    if (!list.is_array()) refuse(where, fmt::format("has a \"{}\" that is not a list", name));
    std::vector<V3d> result;
    result.reserve(list.size());
    for (const Json& entry : list) {
      V3d p;
      bool isPoint = entry.is_array() && entry.size() == 3;
      for (std::size_t axis = 0; isPoint && axis < 3; ++axis) {
        isPoint = entry[axis].is_number() && std::isfinite(entry[axis].get<double>());
        if (isPoint) p[static_cast<int>(axis)] = entry[axis].get<double>();
      }
      if (!isPoint)
        refuse(where, fmt::format("has an invalid point {} in \"{}\"", result.size(), name));
      result.push_back(p);
    }
    return result;
  }

  [[nodiscard]] ParticleLayer layer(const Json& json, const std::string& where) const {
    ParticleLayer layer;
    layer.columns = count(json, "columns", where);
    layer.rows = count(json, "rows", where);
    layer.w = number(json, "w", where);
    layer.height = number(json, "height", where);
    layer.positions = points(json, "positions", where);
    layer.rim = points(json, "rim", where);
    if (layer.positions.size() != layer.columns * layer.rows)
      refuse(where, fmt::format("has {} positions for {} columns and {} rows",
                                layer.positions.size(), layer.columns, layer.rows));
    const std::size_t rim = 2 * (layer.columns + layer.rows) + 4;
    if (layer.hasRim() && layer.rim.size() != rim)
      refuse(where, fmt::format("has a rim of {} particles instead of {}", layer.rim.size(), rim));
    return layer;
  }

  [[nodiscard]] Patch patch(const Json& json, const std::string& where) const {
    Patch patch;
    const std::vector<V3d> corners = points(json, "corners", where);
    if (corners.size() != 4)
      refuse(where, fmt::format("has {} corners instead of 4", corners.size()));
    std::copy(corners.begin(), corners.end(), patch.corners.begin());
    patch.height = number(json, "height", where);
    if (!(patch.height > 0)) refuse(where, "has a height that is not positive");
    const Json& mirrored = member(json, "mirrored", where);
    if (!mirrored.is_boolean()) refuse(where, "has a \"mirrored\" that is neither true nor false");
    patch.mirrored = mirrored.get<bool>();
    patch.spacing = number(json, "spacing", where);
    if (!(patch.spacing > 0)) refuse(where, "has a spacing that is not positive");
    if (json.contains("scheme")) {
      const auto name = std::find(kSchemeNames.begin(), kSchemeNames.end(), json.at("scheme"));
      if (name == kSchemeNames.end()) refuse(where, "has an unknown \"scheme\"");
      patch.scheme = static_cast<LayerScheme>(name - kSchemeNames.begin());
    }
    const Json& layers = member(json, "levels", where);
    if (!layers.is_array() || layers.size() < 2) refuse(where, "has fewer than two layers");
    for (const Json& entry : layers) {
      const std::string place = fmt::format("{}, layer {}", where, patch.layers.size());
      patch.layers.push_back(layer(entry, place));
      const bool isFirst = patch.layers.size() == 1;
      const double below = isFirst ? 0 : patch.layers[patch.layers.size() - 2].w;
      const double w = patch.layers.back().w;
      if (isFirst ? w != 0 : !(w > below))
        refuse(place, fmt::format("is at w = {}; w must increase from 0 to 1", w));
    }
    if (patch.layers.back().w != 1) refuse(where, "ends below w = 1");
    const auto last = static_cast<double>(patch.layers.size() - 1);
    for (std::size_t k = 0; k < patch.layers.size(); ++k)
      if (std::abs(patch.layers[k].w - static_cast<double>(k) / last) > 1e-9)
        refuse(where, "has layers that are not evenly spaced in w");
    return patch;
  }

 private:
  std::string file_;
};

std::string textOf(const std::filesystem::path& file, std::size_t maxMemory) {
  if (file != "-") return levelset::readJsonText(file, "a patch file", maxMemory);
  std::string text, part(std::size_t{1} << 20, '\0');
  while (std::cin.read(part.data(), static_cast<std::streamsize>(part.size())) ||
         std::cin.gcount() > 0) {
    text.append(part, 0, static_cast<std::size_t>(std::cin.gcount()));
    levelset::requireMemory(levelset::kJsonBytesPerCharacter * static_cast<double>(text.size()),
                            maxMemory);
  }
  return text;
}

}  // namespace

void writePatches(const std::filesystem::path& file, std::span<const Patch> patches) {
  Json json;
  json["format"] = kFormat;
  json["version"] = kVersion;
  json["patches"] = Json::array();
  for (const Patch& patch : patches) json["patches"].push_back(toJson(patch));
  levelset::FileTarget target(file);
  {
    std::ofstream stream(target.path(), std::ios::binary);
    stream << json.dump() << '\n';
    stream.flush();
    if (!stream) {
      throw levelset::IoError(
          fmt::format("{} cannot be written; check the free disk space", file.string()));
    }
  }
  target.commit();
}

bool isPatchFormat(const std::string& name) {
  return name == "patch" || std::filesystem::path(name).extension() == ".patch";
}

std::vector<Patch> readPatches(const std::filesystem::path& file, std::size_t maxMemory) {
  const Reader reader(file.string());
  const std::string whole = "the file", text = textOf(file, maxMemory);
  if (levelset::isJsonTooDeep(text)) reader.refuse(whole, "has too deeply nested lists");
  const Json json = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded()) reader.refuse(whole, "is not a JSON document, or is truncated");
  const Json& format = reader.member(json, "format", whole);
  if (format != kFormat) reader.refuse(whole, "is not a patch file");
  if (reader.number(json, "version", whole) != kVersion)
    reader.refuse(whole, fmt::format("does not have version {}", kVersion));
  const Json& list = reader.member(json, "patches", whole);
  if (!list.is_array() || list.empty()) reader.refuse(whole, "has no patches");
  std::vector<Patch> patches;
  for (const Json& entry : list)
    patches.push_back(reader.patch(entry, fmt::format("patch {}", patches.size())));
  return patches;
}

}  // namespace mapping
