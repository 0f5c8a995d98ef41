#include "render/views/scene_file.h"

#include <fmt/core.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/files/json_text.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/terrain/files/height_field_file.h"
#include "levelset/transform/transform.h"
#include "levelset/volume_files/volume_file.h"
#include "render/scene/field_expression.h"
#include "render/views/bezier_file.h"
#include "render/views/picture.h"
#include "render/views/quadric_file.h"
#include "render/views/scene_members.h"

namespace render {
namespace {

using Imath::V3d;
using levelset::InvalidInput;
using Json = nlohmann::ordered_json;
using scene_file::kDegree;
using scene_file::kFormat;
using scene_file::kVersion;

constexpr double kMostBytes = 1 << 24;  // largest size of a scene file, bytes; the file contains
                                        // only names of other files, not their data

/// Reads members of the JSON document. Error messages name the file and the location `where` in it.
class Reader {
 public:
  explicit Reader(const std::filesystem::path& file) : file_(file.string()) {}

  [[noreturn]] void refuse(const std::string& where, const std::string& what) const {
    throw InvalidInput(fmt::format("{}: {} {}; docs/rendering.md describes the format of scenes",
                                   file_, where, what));
  }

  [[nodiscard]] const Json& member(const Json& json, const char* name,
                                   const std::string& where) const {
    if (!json.is_object() || !json.contains(name))
      refuse(where, fmt::format("has no \"{}\"", name));
    return json.at(name);
  }

  [[nodiscard]] std::string text(const Json& json, const char* name,
                                 const std::string& where) const {
    const Json& value = member(json, name, where);
    if (!value.is_string()) refuse(where, fmt::format("has a \"{}\" that is not a string", name));
    return value.get<std::string>();
  }

  /// Reads a member that must be a list of exactly `count` finite numbers, or a single number.
  [[nodiscard]] std::vector<double> numbers(const Json& json, const char* name, std::size_t count,
                                            const std::string& where) const {
    const Json& list = member(json, name, where);
    std::vector<double> all;
    const auto add = [&](const Json& value) {
      if (value.is_number() && std::isfinite(value.get<double>()))
        all.push_back(value.get<double>());
    };
    if (list.is_array())
      for (const Json& value : list) add(value);
    else
      add(list);
    const std::size_t given = list.is_array() ? list.size() : 1;
    if (all.size() != count || given != count)
      refuse(where, fmt::format("has a \"{}\" that is not {} number{}", name, count,
                                count == 1 ? "" : "s"));
    return all;
  }
  [[nodiscard]] V3d point(const Json& json, const char* name, const std::string& where) const {
    const std::vector<double> all = numbers(json, name, 3, where);
    return {all[0], all[1], all[2]};
  }
  [[nodiscard]] double number(const Json& json, const char* name, const std::string& where) const {
    return numbers(json, name, 1, where)[0];
  }

  /// Rejects members of a JSON object whose names are not in `known`, so that a misspelt name is
  /// not ignored.
  void requireKnown(const Json& json, const std::set<std::string>& known,
                    const std::string& where) const {
    if (!json.is_object()) refuse(where, "is not an object");
    for (const auto& [name, value] : json.items())
      if (!known.contains(name)) refuse(where, fmt::format("has an unknown \"{}\"", name));
  }

  [[nodiscard]] Camera camera(const Json& json) const {
    const std::string where = "the camera";
    requireKnown(json, {"from", "to", "up", "fov", "ortho", "near", "far", "size"}, where);
    Camera camera;
    camera.from = point(json, "from", where);
    camera.to = point(json, "to", where);
    if (json.contains("up")) camera.up = point(json, "up", where);
    if (json.contains("fov")) camera.verticalFov = number(json, "fov", where) * kDegree;
    if (json.contains("ortho")) camera.orthoHeight = number(json, "ortho", where);
    if (json.contains("near")) camera.near = number(json, "near", where);
    if (json.contains("far")) camera.far = number(json, "far", where);
    if (json.contains("size")) {
      const std::vector<double> size = numbers(json, "size", 2, where);
      for (const double pixels : size)
        if (!(pixels >= 1 && pixels <= 1e6) || pixels != std::floor(pixels))
          refuse(
              where,
              fmt::format("has a \"size\" of {} pixels, which is not an integer from 1 to 1000000",
                          pixels));
      camera.width = static_cast<int>(size[0]);
      camera.height = static_cast<int>(size[1]);
    }
    return camera;
  }

  [[nodiscard]] Light light(const Json& json) const {
    const std::string where = "the light";
    requireKnown(json, {"direction", "strength", "softness"}, where);
    Light light;
    if (json.contains("direction")) light.direction = point(json, "direction", where);
    if (json.contains("strength")) light.strength = number(json, "strength", where);
    if (json.contains("softness")) light.softness = number(json, "softness", where) * kDegree;
    return light;
  }

  /// Reads the members common to solids and meshes. @param number_  default id of the solid or mesh
  template <typename Part>
  void readPart(const Json& json, std::size_t number_, const std::string& where,
                Part& solid) const {
    solid.name = text(json, "name", where);
    solid.id = static_cast<std::uint32_t>(number_);
    if (json.contains("id")) {
      const double id = number(json, "id", where);
      if (!(id >= 1 && id <= 4294967295.0) || id != std::floor(id))
        refuse(where, "has an \"id\" that is not an integer from 1 to 4294967295");
      solid.id = static_cast<std::uint32_t>(id);
    }
    if (json.contains("colour")) {
      const V3d colour = point(json, "colour", where);
      for (int c = 0; c < 3; ++c)
        if (!(colour[c] >= 0 && colour[c] <= 1))
          refuse(where, "has a \"colour\" with numbers outside the range from 0 to 1");
      solid.colour = Imath::C3f(colour);
    }
    if (json.contains("opacity")) solid.opacity = number(json, "opacity", where);
    if (!(solid.opacity > 0 && solid.opacity <= 1))
      refuse(where, "has an \"opacity\" that is not above 0 and at most 1");
  }

  /// Path of the file of a solid or mesh. A relative name starts at the folder of the scene file
  /// `file`.
  [[nodiscard]] std::filesystem::path partFile(const Json& json, const std::filesystem::path& file,
                                               const std::string& where) const {
    const std::string name = text(json, "file", where);
    if (name == "-")
      refuse(where, "has the \"file\" \"-\" (standard input), which a scene cannot use");
    return file.parent_path() / name;
  }

  /// Calls job() and returns its result. If it rejects the input, adds the file and the location
  /// `where` to the error message.
  template <typename Job>
  auto withContext(const std::string& where, const Job& job) const {
    try {
      return job();
    } catch (const levelset::UsageError& error) {
      refuse(where, fmt::format("is not valid ({})", error.what()));
    } catch (const InvalidInput& error) {
      refuse(where, fmt::format("is not valid ({})", error.what()));
    }
  }

  [[nodiscard]] Imath::M44d matrix(const Json& json, const std::string& where) const {
    const std::vector<double> all = numbers(json, "transform", 16, where);
    Imath::M44d matrix;
    for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = all[static_cast<std::size_t>(i)];
    return matrix;
  }

 private:
  std::string file_;
};

Json documentOf(const std::filesystem::path& file) {
  std::error_code failed;
  const auto size = std::filesystem::file_size(file, failed);
  if (!failed && static_cast<double>(size) > kMostBytes)
    throw InvalidInput(fmt::format(
        "{} is larger than 16 MB, the limit for a scene file; give a scene file", file.string()));
  const std::string text = levelset::readJsonText(file, "the file of a scene");
  if (levelset::isJsonTooDeep(text)) return Json(Json::value_t::discarded);
  return Json::parse(text, nullptr, /*allow_exceptions=*/false);
}

void readSolid(const Reader& reader, const Json& json, const std::filesystem::path& file,
               const ReadSceneOptions& options, const levelset::Progress& progress, Scene& scene) {
  const std::string where = fmt::format("solid {}", scene.solids.size() + 1);
  reader.requireKnown(json, {"name", "file", "grid", "transform", "colour", "opacity", "id"},
                      where);
  Solid solid;
  reader.readPart(json, scene.solids.size() + 1, where, solid);
  const std::filesystem::path source = reader.partFile(json, file, where);
  levelset::BandRepairs repairs;
  solid.band = levelset::readBand(
      source, {.grid = json.contains("grid") ? reader.text(json, "grid", where) : "",
               .maxMemory = options.maxMemory,
               .repairs = &repairs,
               .progress = progress});
  if (solid.band.isOpenSurface())
    reader.refuse(where, "is a band of an open surface, not of a solid");
  if (options.repairs) options.repairs(repairs, source);
  if (json.contains("transform"))
    solid.band = reader.withContext(
        where, [&] { return levelset::transform(solid.band, reader.matrix(json, where)); });
  scene.solids.push_back(std::move(solid));
}

std::size_t bytesOf(const levelset::TriMesh& mesh) {
  const levelset::MeshAttributes& more = mesh.attributes;
  return mesh.positions.size() * sizeof(mesh.positions[0]) +
         mesh.triangles.size() * sizeof(mesh.triangles[0]) + more.normals.size() * sizeof(V3d) +
         more.uvs.size() * sizeof(more.uvs[0]) + more.colors.size() * sizeof(more.colors[0]);
}

void readMeshPart(const Reader& reader, const Json& json, const std::filesystem::path& file,
                  const ReadSceneOptions& options, const levelset::Progress& progress,
                  Scene& scene) {
  const std::string where = fmt::format("mesh {}", scene.meshes.size() + 1);
  reader.requireKnown(json, {"name", "file", "transform", "colour", "opacity", "id"}, where);
  MeshPart part;
  reader.readPart(json, scene.solids.size() + scene.meshes.size() + 1, where, part);
  levelset::TriMesh mesh = levelset::readMesh(
      reader.partFile(json, file, where),
      {.attributes = true, .maxMemory = options.maxMemory, .progress = progress});
  if (json.contains("transform"))
    mesh = reader.withContext(
        where, [&] { return levelset::transform(std::move(mesh), reader.matrix(json, where)); });
  part.mesh = std::make_shared<const levelset::TriMesh>(std::move(mesh));
  scene.meshes.push_back(std::move(part));
}

/// Members of a part of a scene that has no transform.
struct PlainMembers {
  std::string name;
  std::uint32_t id = 0;
  Imath::C3f colour{0.66f, 0.62f, 0.56f};
  double opacity = 1;
};

PlainMembers readPlainMembers(const Reader& reader, const Json& json, const std::string& where,
                              const Scene& scene) {
  PlainMembers part;
  reader.readPart(json,
                  scene.solids.size() + scene.meshes.size() + scene.beziers.size() +
                      scene.quadrics.size() + scene.terrains.size() + 1,
                  where, part);
  return part;
}

void readBezierPart(const Reader& reader, const Json& json, const std::filesystem::path& file,
                    const ReadSceneOptions& options, Scene& scene) {
  const std::string where = fmt::format("Bézier volume {}", scene.beziers.size() + 1);
  reader.requireKnown(json, {"name", "file", "colour", "opacity", "id"}, where);
  const PlainMembers part = readPlainMembers(reader, json, where, scene);
  BezierCaster caster(readBezierVolume(reader.partFile(json, file, where), options.maxMemory),
                      options.maxMemory);
  scene.beziers.push_back({std::move(caster), part.colour, part.id, part.name, part.opacity});
}

void readQuadricPart(const Reader& reader, const Json& json, const std::filesystem::path& file,
                     const ReadSceneOptions& options, Scene& scene) {
  const std::string where = fmt::format("quadrics {}", scene.quadrics.size() + 1);
  reader.requireKnown(json, {"name", "file", "id"}, where);
  const PlainMembers part = readPlainMembers(reader, json, where, scene);
  QuadricCaster caster(readQuadrics(reader.partFile(json, file, where), options.maxMemory),
                       options.maxMemory);
  scene.quadrics.push_back({std::move(caster), part.id, part.name});
}

/// Box of a member that is a list of its lower and its upper corner.
Imath::Box3d readBox(const Reader& reader, const Json& json, const char* name,
                     const std::string& where) {
  const Json& corners = reader.member(json, name, where);
  if (!corners.is_array() || corners.size() != 2)
    reader.refuse(where, fmt::format("has an \"{}\" that is not a list of two corners", name));
  const auto corner = [&](std::size_t n) {
    const Json one = {{name, corners[n]}};
    return reader.point(one, name, where);
  };
  return {corner(0), corner(1)};
}

std::vector<HeightColour> readRamp(const Reader& reader, const Json& json,
                                   const std::string& where) {
  const Json& list = reader.member(json, "ramp", where);
  if (!list.is_array()) reader.refuse(where, "has a \"ramp\" that is not a list");
  std::vector<HeightColour> ramp;
  for (const Json& entry : list) {
    reader.requireKnown(entry, {"height", "colour"}, where);
    ramp.push_back(
        {reader.number(entry, "height", where), Imath::C3f(reader.point(entry, "colour", where))});
  }
  reader.withContext(where, [&] { requireRamp(ramp); });
  return ramp;
}

void readTerrainPart(const Reader& reader, const Json& json, const std::filesystem::path& file,
                     const ReadSceneOptions& options, const levelset::Progress& progress,
                     Scene& scene) {
  const std::string where = fmt::format("terrain {}", scene.terrains.size() + 1);
  reader.requireKnown(
      json, {"name", "file", "transform", "colour", "id", "smooth", "outside", "ramp"}, where);
  const PlainMembers part = readPlainMembers(reader, json, where, scene);
  TerrainOptions how;
  if (json.contains("transform")) how.transform = reader.matrix(json, where);
  if (json.contains("outside")) how.outside = readBox(reader, json, "outside", where);
  if (json.contains("smooth")) {
    if (!json.at("smooth").is_boolean())
      reader.refuse(where, "has a \"smooth\" that is not true or false");
    how.isSmooth = json.at("smooth").get<bool>();
  }
  std::vector<HeightColour> ramp;
  if (json.contains("ramp")) ramp = readRamp(reader, json, where);
  auto field = std::make_shared<const levelset::HeightField>(levelset::readHeightField(
      reader.partFile(json, file, where), {.maxMemory = options.maxMemory, .progress = progress}));
  how.maxBytes = options.maxMemory - std::min(options.maxMemory, field->memoryUse());
  TerrainCaster caster =
      reader.withContext(where, [&] { return TerrainCaster(std::move(field), how); });
  scene.terrains.push_back({std::move(caster), part.colour, part.id, part.name, std::move(ramp)});
}

/// The volume with its grid placed in the world by a transform.
levelset::Volume placedBy(const Imath::M44d& transform, const levelset::Volume& volume,
                          const levelset::Progress& progress) {
  for (int row = 0; row < 4; ++row)
    if (transform[row][3] != (row == 3 ? 1 : 0))
      throw InvalidInput(
          "the last column of the transform is not 0, 0, 0, 1; give these numbers there, and a "
          "translation in the last row");
  levelset::VolumeGrid grid = volume.grid();
  grid.indexToWorld = grid.indexToWorld * transform;
  // The copy shares the numbers.
  const auto owner = std::make_shared<const levelset::Volume>(volume);
  return {
      grid, volume.type(), volume.scale(), {owner, owner->numbers(), owner->isMapped()}, progress};
}

void readVolumePart(const Reader& reader, const Json& json, const std::filesystem::path& file,
                    const ReadSceneOptions& options, const levelset::Progress& progress,
                    Scene& scene) {
  const std::string where = "volume 1";
  reader.requireKnown(json, {"name", "file", "frame", "transform", "transfer", "shading"}, where);
  levelset::ReadVolumeOptions how{.maxMemory = options.maxMemory, .progress = progress};
  if (json.contains("frame")) {
    const double frame = reader.number(json, "frame", where);
    if (!(frame >= 0 && frame <= 1e9) || frame != std::floor(frame))
      reader.refuse(where, "has a \"frame\" that is not an integer of at least 0");
    how.frame = static_cast<int>(frame);
  }
  const std::string name = reader.text(json, "name", where),
                    transfer = reader.text(json, "transfer", where);
  bool isShaded = true;
  if (json.contains("shading")) {
    if (!json.at("shading").is_boolean())
      reader.refuse(where, "has a \"shading\" that is not true or false");
    isShaded = json.at("shading").get<bool>();
  }
  const std::vector<TransferPoint> points =
      reader.withContext(where, [&] { return parseTransfer(transfer); });
  const std::filesystem::path source = reader.partFile(json, file, where);
  if (!levelset::isVolumeFormat(source) || levelset::isRawFormat(source))
    reader.refuse(where,
                  "has a \"file\" without the header of a volume; use NIfTI, MetaImage, "
                  "NRRD or MRC");
  levelset::Volume volume = levelset::readVolume(source, how);
  reader.withContext(where, [&] {
    if (json.contains("transform")) volume = placedBy(reader.matrix(json, where), volume, progress);
    // The isovalue has no effect: the surface provides the ranges of the values.
    const VolumeSurface surface(volume, volume.highest(), VolumeInside::Above, progress);
    scene.volumePart = VolumePart{DirectVolume(surface, points), isShaded, name};
  });
}

}  // namespace

bool isSceneFormat(const std::string& name) {
  return name == "json" || std::filesystem::path(name).extension() == ".json";
}

ViewedScene readScene(const std::filesystem::path& file, const ReadSceneOptions& options) {
  if (isBezierFile(file)) {
    const std::size_t most = levelset::memoryLimit(options.maxMemory);
    ViewedScene alone;
    alone.scene.beziers.push_back(
        {.caster = BezierCaster(readBezierVolume(file, most), most), .name = "volume"});
    return alone;
  }
  if (isQuadricFile(file)) {
    const std::size_t most = levelset::memoryLimit(options.maxMemory);
    ViewedScene alone;
    alone.scene.quadrics.push_back(
        {.caster = QuadricCaster(readQuadrics(file, most), most), .name = "quadrics"});
    return alone;
  }
  const Reader reader(file);
  const Json json = documentOf(file);
  const std::string whole = "the file";
  if (json.is_discarded()) reader.refuse(whole, "is not a JSON document, or is incomplete");
  if (reader.text(json, "format", whole) != kFormat) reader.refuse(whole, "is not a scene");
  if (reader.number(json, "version", whole) != kVersion)
    reader.refuse(whole, fmt::format("is not of version {}", kVersion));
  reader.requireKnown(json,
                      {"format", "version", "camera", "light", "ambient", "solids", "meshes",
                       "beziers", "quadrics", "terrains", "volumes", "csg", "soft", "morph"},
                      whole);
  ViewedScene viewed;
  Scene& scene = viewed.scene;
  viewed.hasCamera = json.contains("camera");
  if (viewed.hasCamera) {
    scene.camera = reader.camera(json.at("camera"));
    reader.withContext("the camera", [&] { validate(scene.camera); });
  }
  if (json.contains("light")) scene.key = reader.light(json.at("light"));
  if (json.contains("ambient")) scene.ambient = reader.number(json, "ambient", whole);
  reader.withContext("the light", [&] { requireLight(scene); });
  const Json none = Json::array();
  const Json& solids = json.contains("solids") ? json.at("solids") : none;
  const Json& meshes = json.contains("meshes") ? json.at("meshes") : none;
  const Json& volumes = json.contains("volumes") ? json.at("volumes") : none;
  const Json& beziers = json.contains("beziers") ? json.at("beziers") : none;
  const Json& quadrics = json.contains("quadrics") ? json.at("quadrics") : none;
  const Json& terrains = json.contains("terrains") ? json.at("terrains") : none;
  const Json* const lists[] = {&solids, &meshes, &volumes, &beziers, &quadrics, &terrains};
  if (!std::all_of(std::begin(lists), std::end(lists),
                   [](const Json* l) { return l->is_array(); }) ||
      std::all_of(std::begin(lists), std::end(lists), [](const Json* l) { return l->empty(); }))
    reader.refuse(whole,
                  "has no parts; list one in \"solids\", \"meshes\", \"volumes\", \"beziers\", "
                  "\"quadrics\" or \"terrains\"");
  if (volumes.size() > 1) reader.refuse(whole, "has several \"volumes\", but a scene can have one");
  scene_file::Parts parts(options.progress,
                          solids.size() + meshes.size() + terrains.size() + volumes.size());
  // The memory limit applies to the sum of all parts, so it shrinks with each one that is read.
  ReadSceneOptions rest = options;
  rest.maxMemory = levelset::memoryLimit(options.maxMemory);
  const auto spend = [&rest](std::size_t bytes) {
    rest.maxMemory -= std::min(rest.maxMemory, bytes);
  };
  for (const Json& entry : solids) {
    readSolid(reader, entry, file, rest, parts.next(), scene);
    spend(scene.solids.back().band.memoryUse());
  }
  for (const Json& entry : meshes) {
    readMeshPart(reader, entry, file, rest, parts.next(), scene);
    spend(bytesOf(*scene.meshes.back().mesh));
  }
  for (const Json& entry : beziers) {
    readBezierPart(reader, entry, file, rest, scene);
    spend(scene.beziers.back().caster.bytes());
  }
  for (const Json& entry : quadrics) {
    readQuadricPart(reader, entry, file, rest, scene);
    spend(scene.quadrics.back().caster.bytes());
  }
  for (const Json& entry : terrains) {
    readTerrainPart(reader, entry, file, rest, parts.next(), scene);
    spend(scene.terrains.back().caster.bytes());
  }
  for (const Json& entry : volumes) readVolumePart(reader, entry, file, rest, parts.next(), scene);
  reader.withContext(whole, [&] { scene_file::requireNames(scene); });
  std::set<std::uint32_t> ids;
  const auto isNew = [&](const auto& part) { return ids.insert(part.id).second; };
  if (!std::all_of(scene.solids.begin(), scene.solids.end(), isNew) ||
      !std::all_of(scene.meshes.begin(), scene.meshes.end(), isNew) ||
      !std::all_of(scene.beziers.begin(), scene.beziers.end(), isNew) ||
      !std::all_of(scene.quadrics.begin(), scene.quadrics.end(), isNew) ||
      !std::all_of(scene.terrains.begin(), scene.terrains.end(), isNew))
    reader.refuse(whole, "gives the same \"id\" to two parts; give each part its own");
  if (json.contains("csg"))
    scene.csg = CsgExpression(reader.text(json, "csg", whole), scene_file::operandNames(scene));
  if (json.contains("soft")) scene.softness = reader.number(json, "soft", whole);
  if (json.contains("morph")) scene.morph = reader.number(json, "morph", whole);
  reader.withContext(whole, [&] {
    requireOperands(scene);
    requireFields(scene);
  });
  return viewed;
}

}  // namespace render
