#include <fmt/core.h>

#include <map>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/operators/solids/deformation_options.h"
#include "apps/pipeline/operators/terrain/terrain_figures.h"
#include "apps/pipeline/operators/tiled_terrain.h"
#include "apps/pipeline/operators/volume_params.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/molecules/molecule_file.h"
#include "levelset/point_files/point_file.h"
#include "levelset/points/processing/point_spacing.h"
#include "levelset/terrain/files/height_field_file.h"
#include "levelset/terrain/tiles/tiled_ground.h"
#include "levelset/volume_files/volume_file.h"

namespace pipeline {
namespace {

/// Returns null for 0, which stands for a count that is missing in the header of the file.
Json countOrNull(std::uint64_t count) {
  return count > 0 ? Json(count) : Json(nullptr);
}

void addMolecule(Json& json, const levelset::Molecule& molecule) {
  json["atoms"] = molecule.atoms.size();
  json["residues"] = molecule.residues.size();
  json["chains"] = molecule.chains;
  json["file_bonds"] = molecule.bonds.size();
  std::map<int, std::size_t> counts;
  for (const levelset::Atom& atom : molecule.atoms) ++counts[atom.element];
  Json& elements = json["elements"] = Json::object();
  for (const auto& [element, count] : counts)
    elements[element ? std::string(levelset::elementSymbol(element)) : "unknown"] = count;
}

void validateInfo(const Invocation& in) {
  if (!in.given("file")) return;
  const std::string name = formatName(in);
  if (levelset::isMeshFormat(name) || levelset::isPointFormat(name)) return;
  if (levelset::isBandFormat(name) && !name.ends_with("nvdb")) return;
  if (levelset::isVolumeFormat(name) && !levelset::isRawFormat(name)) return;
  if (levelset::holdsMolecule(name) || levelset::isHeightFormat(name) ||
      levelset::isTiledGroundFormat(name))
    return;
  throw levelset::UsageError(
      fmt::format("info: '{}' is of no known format; info reads ply, obj, stl, off, xyz, csv, pts "
                  "(also .gz), vdb, "
                  "nii, mha, nrrd, mrc, pdb, cif, asc, hgt, flt, bil, tif and lst",
                  name));
}

Json fileInfo(const std::string& file, const std::string& format, std::size_t maxMemory) {
  Json json;
  json["file"] = file;
  const std::string name = format.empty() ? file : format;
  if (levelset::holdsMolecule(name)) {
    addMolecule(json, levelset::readMolecule(file, {.format = format, .solvent = true}));
    return json;
  }
  if (levelset::isTiledGroundFormat(name)) {
    addTiledTerrain(json, file, maxMemory);
    return json;
  }
  if (levelset::isHeightFormat(name)) {
    addTerrain(json, levelset::readHeightField(file, {.format = format, .maxMemory = maxMemory}));
    return json;
  }
  if (levelset::isPointFormat(name) || levelset::lacksFaces(file, format)) {
    const levelset::PointFileInfo info = levelset::pointFileInfo(file, format);
    json["format"] = info.format;
    json["points"] = countOrNull(info.points);
    if (!info.attributes.empty()) json["attributes"] = info.attributes;
    return json;
  }
  if (levelset::isMeshFormat(name)) {
    const levelset::MeshFileInfo info = levelset::meshFileInfo(file, format);
    json["format"] = info.format;
    json["vertices"] = countOrNull(info.vertices);
    json["faces"] = countOrNull(info.faces);
    if (!info.attributes.empty()) json["attributes"] = info.attributes;
    return json;
  }
  if (levelset::isVolumeFormat(name)) {
    const levelset::VolumeFileInfo info = levelset::volumeFileInfo(file, {.format = format});
    json["format"] = info.format;
    addVolumeGrid(json, info.grid);
    json["type"] = info.storedType;
    json["big_endian"] = info.isBigEndian;
    json["encoding"] = info.encoding;
    json["slope"] = info.scale.slope;
    json["intercept"] = info.scale.intercept;
    return json;
  }
  json["grids"] = Json::array();
  for (const levelset::GridInfo& grid : levelset::bandFileInfo(file)) {
    Json entry{{"name", grid.name},
               {"type", grid.type},
               {"class", grid.gridClass},
               {"voxel_size", grid.voxelSize},
               {"active_voxels", countOrNull(grid.activeVoxels)},
               {"bytes", countOrNull(grid.bytes)}};
    entry["index_bounds"] = toJson(grid.indexBounds);
    json["grids"].push_back(entry);
  }
  return json;
}

void addCloud(Json& json, const levelset::PointCloud& cloud, Invocation& in) {
  json["points"] = cloud.size();
  if (const std::string attributes = describe(cloud); !attributes.empty())
    json["attributes"] = attributes;
  const levelset::PointSpacing spacing = levelset::pointSpacing(cloud, in.maxMemory, in.progress);
  json["duplicates"] = spacing.duplicates;
  if (spacing.greatest > 0)
    json["spacing"] = {{"mean", spacing.mean},
                       {"median", spacing.median},
                       {"percentile_5", spacing.percentile5},
                       {"percentile_95", spacing.percentile95},
                       {"least", spacing.least},
                       {"greatest", spacing.greatest}};
  else
    json["spacing"] = nullptr;
}

void addScene(Json& json, const render::Scene& scene) {
  json["solids"] = Json::array();
  for (const render::Solid& solid : scene.solids)
    json["solids"].push_back({{"name", solid.name},
                              {"id", solid.id},
                              {"voxel_size", solid.band.voxelSize()},
                              {"active_voxels", solid.band.activeVoxelCount()}});
  for (const render::MeshPart& part : scene.meshes)
    json["meshes"].push_back(
        {{"name", part.name}, {"id", part.id}, {"triangles", part.mesh->triangles.size()}});
  for (const render::BezierPart& part : scene.beziers)
    json["beziers"].push_back({{"name", part.name},
                               {"id", part.id},
                               {"patches", part.caster.volume().patches.size()},
                               {"attributes", part.caster.volume().attributeCount()}});
  for (const render::QuadricPart& part : scene.quadrics)
    json["quadrics"].push_back({{"name", part.name},
                                {"id", part.id},
                                {"quadrics", part.caster.count()},
                                {"bytes", part.caster.bytes()}});
  for (const render::TerrainPart& part : scene.terrains)
    json["terrains"].push_back({{"name", part.name},
                                {"id", part.id},
                                {"columns", part.caster.field().columns},
                                {"rows", part.caster.field().rows},
                                {"bytes", part.caster.bytes()}});
  for (const render::MappedTexture& texture : scene.mapped)
    json["mapped"].push_back({{"name", texture.name},
                              {"id", texture.id},
                              {"voxel_size", texture.band.voxelSize()},
                              {"active_voxels", texture.band.activeVoxelCount()},
                              {"shells", texture.shells->size()}});
  if (scene.volumePart) {
    const Imath::V3i size = scene.volumePart->volume.volume().size();
    json["volumes"].push_back(
        {{"name", scene.volumePart->name},
         {"size", {size.x, size.y, size.z}},
         {"transfer", render::transferText(scene.volumePart->volume.transfer().points())}});
  }
  if (!scene.csg.isEmpty()) json["csg"] = scene.csg.text();
  if (scene.softness > 0) json["soft"] = scene.softness;
  if (scene.morph) json["morph"] = *scene.morph;
}

Json valueInfo(const Value& value, Invocation& in) {
  Json json;
  json["kind"] = kindName(value.kind());
  json["bounds"] = toJson(value.plan().bounds);
  if (value.kind() == Kind::Band || value.kind() == Kind::Surface) {
    json["voxel_size"] = value.band().voxelSize();
    json["half_width"] = value.band().halfWidth();
    json["active_voxels"] = value.band().activeVoxelCount();
    json["bytes"] = value.band().memoryUse();
    json["hash"] = fmt::format("{:016x}", value.band().contentHash());
  } else if (value.kind() == Kind::Mesh) {
    json["vertices"] = value.mesh().positions.size();
    json["triangles"] = value.mesh().triangles.size();
    if (!value.mesh().attributes.isEmpty()) json["attributes"] = describe(value.mesh().attributes);
  } else if (value.kind() == Kind::Field) {
    const levelset::FieldGrid& field = value.field();
    json["values"] = field.isVector() ? "vectors" : "numbers";
    json["class"] = field.gridClass();
    json["voxel_size"] = field.voxelSize();
    json["active_voxels"] = field.activeVoxelCount();
    json["bytes"] = field.memoryUse();
    json["hash"] = fmt::format("{:016x}", field.contentHash());
  } else if (value.kind() == Kind::Volume) {
    const levelset::Volume& volume = value.volume();
    addVolumeGrid(json, volume.grid());
    json["type"] = levelset::volumeTypeName(volume.type());
    json["slope"] = volume.scale().slope;
    json["intercept"] = volume.scale().intercept;
    json["range"] = Json::array({volume.lowest(), volume.highest()});
    json["bytes"] = volume.memoryUse();
    json["mapped"] = volume.isMapped();
    json["hash"] = fmt::format("{:016x}", volume.contentHash());
  } else if (value.kind() == Kind::Adaptive) {
    const levelset::AdaptiveField& field = value.adaptive();
    json["tolerance"] = field.tolerance();
    json["width"] = field.halfWidth();
    json["interpolation"] = field.isTricubic() ? "tricubic" : "trilinear";
    json["cells"] = field.leafCount();
    json["bytes"] = field.memoryUse();
    json["hash"] = fmt::format("{:016x}", field.contentHash());
  } else if (value.kind() == Kind::Segmentation) {
    const levelset::SegmentedField& field = value.segmentation();
    json["labels"] = field.labels();
    if (!field.sheetLabels().empty()) json["sheets"] = field.sheetLabels();
    json["voxel_size"] = field.voxelSize();
    json["half_width"] = field.halfWidth();
    json["active_voxels"] = field.activeVoxelCount();
    json["bytes"] = field.memoryUse();
    json["hash"] = fmt::format("{:016x}", field.contentHash());
  } else if (value.kind() == Kind::Deformation) {
    addDeformation(json, value.deformation());
  } else if (value.kind() == Kind::Molecule) {
    addMolecule(json, value.molecule());
  } else if (value.kind() == Kind::Terrain) {
    addTerrain(json, value.terrain());
  } else if (value.kind() == Kind::Points) {
    addCloud(json, value.cloud(), in);
  } else if (value.kind() == Kind::Scene) {
    addScene(json, value.scene().scene);
  } else {
    const std::vector<mapping::Patch>& patches = value.patch().patches;
    std::size_t particles = 0;
    for (const mapping::Patch& patch : patches) particles += patch.particleCount();
    json["patches"] = patches.size();
    json["levels"] = patches.front().layers.size();
    json["particles"] = particles;
  }
  return json;
}

void appendText(const Json& json, const std::string& indent, std::string& text) {
  for (const auto& [key, entry] : json.items()) {
    if (entry.is_array() && !entry.empty() && entry[0].is_object()) {
      for (const Json& item : entry) {
        text += indent + key + ":\n";
        appendText(item, indent + "  ", text);
      }
    } else if (!entry.is_null()) {
      text += fmt::format("{}{:<16}{}\n", indent, key,
                          entry.is_string()
                              ? entry.get<std::string>()
                              : entry.dump(-1, ' ', false, Json::error_handler_t::replace));
    }
  }
}

Value info(Invocation& in) {
  Json json;
  if (in.given("file")) {
    json = fileInfo(in.text("file"), in.text("format"), in.maxMemory);
  } else if (!in.operands.empty()) {
    json = valueInfo(in.operands[0], in);
  } else {
    throw levelset::UsageError(
        "info: there is nothing to describe; name a file, or put info after an action that makes a "
        "value");
  }
  if (asksJson(in))
    in.output = printed(json);
  else
    appendText(json, "", in.output);
  return in.operands.empty() ? Value(Plan{}) : in.operands[0];
}

}  // namespace

Operator infoOperator() {
  return {
      .name = "info",
      .group = "Inspection",
      .summary = "describe the newest value, or a file without loading its voxels",
      .details =
          "For a point cloud, spacing describes the distances from each point to its nearest "
          "neighbour at another position; duplicates are points at the position of an earlier one.",
      .example = "levelsmith sphere --radius 1 --voxel 0.05 ! info",
      .params =
          {{.name = "file",
            .type = ParamType::Path,
            .doc = "mesh, volume, point, molecule, terrain or .vdb file to describe; default: the "
                   "newest value",
            .position = 0},
           {.name = "format",
            .type = ParamType::Text,
            .doc = "format of the file; default: by its extension"},
           jsonParam()},
      .operands = {{Kind::Band, Kind::Mesh, Kind::Patch, Kind::Field, Kind::Surface, Kind::Scene,
                    Kind::Volume, Kind::Points, Kind::Adaptive, Kind::Segmentation, Kind::Molecule,
                    Kind::Terrain, Kind::Deformation}},
      .operandsOptional = true,
      .flow = Flow::PassesThrough,
      .run = info,
      .plan = [](Invocation&) { return Plan{}; },
      .cost = [](Invocation&) { return Cost(); },
      .validate = validateInfo,
      .usesStandardOutput = asksJson,
      .usesStandardInput = [](const Invocation& in) { return in.text("file") == "-"; },
  };
}

}  // namespace pipeline
