// Writes scene files, and checks the names of their parts.

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "levelset/error.h"
#include "levelset/file_target.h"
#include "levelset/files/band_file.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/terrain/files/height_field_file.h"
#include "render/scene/field_expression.h"
#include "render/views/bezier_file.h"
#include "render/views/picture.h"
#include "render/views/quadric_file.h"
#include "render/views/scene_file.h"
#include "render/views/scene_members.h"

namespace render {
namespace {

using Imath::V3d;
using levelset::InvalidInput;
using scene_file::kDegree;
using Json = nlohmann::ordered_json;

Json toJson(const V3d& v) {
  return {v.x, v.y, v.z};
}

/// Converts a colour to the shortest decimal numbers that are read back as the same floats.
Json colourJson(const Imath::C3f& colour) {
  const auto shortest = [](float c) { return std::stod(fmt::format("{}", c)); };
  return {shortest(colour.x), shortest(colour.y), shortest(colour.z)};
}

Json toJson(const Camera& camera) {
  Json json = {{"from", toJson(camera.from)}, {"to", toJson(camera.to)}, {"up", toJson(camera.up)}};
  if (camera.orthoHeight)
    json["ortho"] = *camera.orthoHeight;
  else
    json["fov"] = camera.verticalFov / kDegree;
  if (camera.near > 0) json["near"] = camera.near;
  if (camera.far) json["far"] = *camera.far;
  json["size"] = {camera.width, camera.height};
  return json;
}

Json terrainJson(const TerrainPart& part, const std::string& file) {
  Json entry = {
      {"name", part.name}, {"file", file}, {"colour", colourJson(part.colour)}, {"id", part.id}};
  const TerrainOptions& options = part.caster.options();
  if (options.transform != Imath::M44d())
    for (int i = 0; i < 16; ++i) entry["transform"].push_back(options.transform[i / 4][i % 4]);
  if (!options.isSmooth) entry["smooth"] = false;
  if (options.outside)
    entry["outside"] = {toJson(options.outside->min), toJson(options.outside->max)};
  for (const auto& [height, colour] : part.ramp)
    entry["ramp"].push_back({{"height", height}, {"colour", colourJson(colour)}});
  return entry;
}

/// File of a solid or mesh with the given name, in the folder of the scene file `file`.
std::filesystem::path fileBeside(const std::filesystem::path& file, const std::string& name,
                                 const char* extension) {
  return file.parent_path() / (file.stem().string() + "-" + name + extension);
}

/// Converts the document to text. It is called before any file is written, because it fails for
/// names that are not UTF-8.
std::string textOf(const Json& json, const std::filesystem::path& file) {
  try {
    return json.dump(2);
  } catch (const Json::exception&) {
    throw levelset::IoError(fmt::format(
        "{} cannot be stored in a scene, because its name is not UTF-8; use another name",
        file.string()));
  }
}

}  // namespace

namespace scene_file {

std::vector<std::string> solidNames(const Scene& scene) {
  std::vector<std::string> names;
  for (const Solid& solid : scene.solids) names.push_back(solid.name);
  return names;
}

std::vector<std::string> operandNames(const Scene& scene) {
  std::vector<std::string> names = solidNames(scene);
  for (const BezierPart& part : scene.beziers) names.push_back(part.name);
  return names;
}

void requireNames(const Scene& scene) {
  std::vector<std::string> names = solidNames(scene);
  for (const MeshPart& part : scene.meshes) names.push_back(part.name);
  for (const BezierPart& part : scene.beziers) names.push_back(part.name);
  for (const QuadricPart& part : scene.quadrics) names.push_back(part.name);
  for (const TerrainPart& part : scene.terrains) names.push_back(part.name);
  if (scene.volumePart) names.push_back(scene.volumePart->name);
  requireSceneNames(names);
}

}  // namespace scene_file

void requireSceneNames(const std::vector<std::string>& names) {
  std::set<std::string> seen;
  for (const std::string& name : names) {
    const auto isWord = [](unsigned char c) { return std::isalnum(c) || c == '_'; };
    if (name.empty() || std::isdigit(static_cast<unsigned char>(name[0])) ||
        !std::all_of(name.begin(), name.end(), isWord))
      throw levelset::UsageError(fmt::format(
          "scene: '{}' is not a valid name of a part; use letters, digits and _, and no "
          "digit first",
          name));
    if (!seen.insert(name).second)
      throw levelset::UsageError(
          fmt::format("scene: '{}' is the name of two parts; give each a different name", name));
  }
}

void writeScene(const std::filesystem::path& file, const ViewedScene& viewed,
                const levelset::Progress& progress) {
  const Scene& scene = viewed.scene;
  if (!scene.mapped.empty())
    throw levelset::UsageError(
        "a scene file cannot hold mapped textures; draw the scene with `render`, or map the "
        "texture without --instances");
  if (scene.volumePart)
    throw levelset::UsageError(
        "a scene file cannot hold the numbers of a volume; write the scene without the volume, and "
        "add the volume's file to the list \"volumes\" of the scene file");
  scene_file::requireNames(scene);
  requireLight(scene);
  requireOpacity(scene);
  requireFields(scene);
  for (const Solid& solid : scene.solids) requireColour(solid.colour);
  for (const MeshPart& part : scene.meshes) requireColour(part.colour);
  for (const TerrainPart& part : scene.terrains) {
    requireColour(part.colour);
    requireRamp(part.ramp);
  }
  Json json;
  json["format"] = scene_file::kFormat;
  json["version"] = scene_file::kVersion;
  if (viewed.hasCamera) {
    validate(scene.camera);
    json["camera"] = toJson(scene.camera);
  }
  json["light"] = {{"direction", toJson(scene.key.direction)},
                   {"strength", scene.key.strength},
                   {"softness", scene.key.softness / kDegree}};
  json["ambient"] = scene.ambient;
  const auto entryOf = [&](const auto& part, const char* extension) -> Json {
    Json entry = {{"name", part.name},
                  {"file", fileBeside(file, part.name, extension).filename().string()},
                  {"colour", colourJson(part.colour)},
                  {"id", part.id}};
    if (part.opacity < 1) entry["opacity"] = part.opacity;
    return entry;
  };
  json["solids"] = Json::array();
  for (const Solid& solid : scene.solids) json["solids"].push_back(entryOf(solid, ".vdb"));
  for (const MeshPart& part : scene.meshes) json["meshes"].push_back(entryOf(part, ".ply"));
  for (const BezierPart& part : scene.beziers) json["beziers"].push_back(entryOf(part, ".json"));
  for (const QuadricPart& part : scene.quadrics)
    json["quadrics"].push_back({{"name", part.name},
                                {"file", fileBeside(file, part.name, ".json").filename().string()},
                                {"id", part.id}});
  for (const TerrainPart& part : scene.terrains)
    json["terrains"].push_back(
        terrainJson(part, fileBeside(file, part.name, ".asc").filename().string()));
  if (!scene.csg.isEmpty()) json["csg"] = scene.csg.text();
  if (scene.softness > 0) json["soft"] = scene.softness;
  if (scene.morph) json["morph"] = *scene.morph;

  const std::string text = textOf(json, file);
  levelset::FileTarget target(file);
  scene_file::Parts parts(progress,
                          scene.solids.size() + scene.meshes.size() + scene.terrains.size());
  for (const Solid& solid : scene.solids)
    levelset::writeBand(fileBeside(file, solid.name, ".vdb"), solid.band,
                        {.name = solid.name, .progress = parts.next()});
  for (const MeshPart& part : scene.meshes)
    levelset::writeMesh(fileBeside(file, part.name, ".ply"), *part.mesh,
                        {.progress = parts.next()});
  for (const BezierPart& part : scene.beziers)
    writeBezierVolume(fileBeside(file, part.name, ".json"), part.caster.volume());
  for (const QuadricPart& part : scene.quadrics)
    writeQuadrics(fileBeside(file, part.name, ".json"), part.caster.model());
  for (const TerrainPart& part : scene.terrains)
    levelset::writeHeightField(fileBeside(file, part.name, ".asc"), part.caster.field(),
                               {.progress = parts.next()});
  {
    std::ofstream stream(target.path(), std::ios::binary);
    stream << text << '\n';
    stream.flush();
    if (!stream)
      throw levelset::IoError(fmt::format(
          "{} cannot be written; free some space or choose another folder", file.string()));
  }
  target.commit();
}

}  // namespace render
