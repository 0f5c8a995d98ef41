#include <fmt/core.h>

#include <map>
#include <numbers>

#include <cmath>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/operators/solids/adaptive_actions.h"
#include "apps/pipeline/operators/solids/deformation_options.h"
#include "apps/pipeline/operators/solids/segment_actions.h"
#include "apps/pipeline/operators/terrain/terrain_figures.h"
#include "apps/pipeline/operators/tiled_terrain.h"
#include "apps/pipeline/operators/volume_params.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/adaptive/adaptive_to_mesh.h"
#include "levelset/adaptive/compare_adaptive.h"
#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/inspect/check.h"
#include "levelset/inspect/compare.h"
#include "levelset/inspect/measure.h"
#include "levelset/inspect/mesh_quality.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/molecules/molecule_file.h"
#include "levelset/point_files/point_file.h"
#include "levelset/points/processing/point_spacing.h"
#include "levelset/terrain/files/height_field_file.h"
#include "levelset/terrain/tiles/tiled_ground.h"
#include "levelset/volume_files/volume_file.h"

namespace pipeline {
namespace {

Json toJson(const Imath::V3d& v) {
  return Json::array({v.x, v.y, v.z});
}
Json toJson(const Imath::Box3d& box) {
  if (box.isEmpty()) return nullptr;
  return {{"min", toJson(box.min)}, {"max", toJson(box.max)}};
}

std::string figureText(const Json& figure) {
  return figure.is_number_float() ? fmt::format("{:.9g}", figure.get<double>()) : figure.dump();
}

std::string coordinates(const Imath::V3d& v) {
  return fmt::format("{:.6g},{:.6g},{:.6g}", v.x, v.y, v.z);
}

/// Text of the figures of a segmentation: one line for each region and interface.
std::string regionsText(const Json& json) {
  std::string text;
  for (const auto& [key, entry] : json.items())
    if (!entry.is_array() && !entry.is_object())
      text += fmt::format("{:<22}{}\n", key, figureText(entry));
  for (const Json& material : json["materials"])
    text += fmt::format("material {:<13}volume {:.9g}, area {:.9g}\n", material["label"].get<int>(),
                        material["volume"].get<double>(), material["area"].get<double>());
  for (const Json& side : json["interfaces"])
    text += fmt::format(
        "interface {:<12}area {:.9g}\n",
        fmt::format("{}|{}", side["labels"][0].get<int>(), side["labels"][1].get<int>()),
        side["area"].get<double>());
  return text;
}

Value measureRegions(Invocation& in) {
  const Json json = measuresOf(in.operands[0].segmentation(), in);
  in.notes.detailsJson = json.dump();
  in.output = asksJson(in) ? printed(json) : regionsText(json);
  return in.operands[0];
}

Value measure(Invocation& in) {
  const Value& value = in.operands[0];
  if (value.kind() == Kind::Segmentation) return measureRegions(in);
  if (value.kind() == Kind::Terrain) return measureTerrain(in);
  levelset::Measurement m;
  if (value.kind() == Kind::Band)
    m = in.flag("sharp") ? levelset::measureSharp(value.band(), in.progress)
                         : levelset::measure(value.band(), in.progress);
  else if (value.kind() == Kind::Mesh)
    m = levelset::measure(value.mesh(), in.progress);
  else
    m = levelset::measure(
        levelset::adaptiveToMesh(
            value.adaptive(),
            {.maxMemory = in.maxMemory, .progress = levelset::subProgress(in.progress, 0, 0.5)}),
        levelset::subProgress(in.progress, 0.5, 1));
  Json json;
  json["volume"] = m.volume;
  json["area"] = m.area;
  json["bounds"] = toJson(m.bounds);
  json["active_voxels"] = m.activeVoxels;
  json["voxel_size"] = m.voxelSize;
  json["half_width"] = m.halfWidth;
  json["components"] = m.components;
  json["shells"] = m.surfaces;
  json["cavities"] = m.cavities;
  json["euler"] = m.euler;
  json["centroid"] = toJson(m.centroid);
  json["inertia"] = Json::array();
  for (int i = 0; i < 3; ++i)
    json["inertia"].push_back(
        toJson(Imath::V3d(m.inertia[i][0], m.inertia[i][1], m.inertia[i][2])));
  json["mean_curvature"] = m.meanCurvature;
  if (value.kind() == Kind::Adaptive) {
    json["cells"] = value.adaptive().leafCount();
    json["tolerance"] = value.adaptive().tolerance();
  }
  if (value.kind() == Kind::Mesh) {
    const levelset::Manifoldness manifold = levelset::manifoldness(value.mesh());
    json["closed_manifold"] = manifold.isClosedManifold();
    json["boundary_edges"] = manifold.boundaryEdges;
    json["non_manifold_edges"] = manifold.nonManifoldEdges;
    json["misoriented_edges"] = manifold.misorientedEdges;
    json["non_manifold_vertices"] = manifold.nonManifoldVertices;
    json["triangles"] = value.mesh().triangles.size();
    json["vertices"] = value.mesh().positions.size();
    const levelset::MeshQuality quality = levelset::meshQuality(value.mesh());
    constexpr double kDegrees = 180 / std::numbers::pi;
    json["least_angle_degrees"] = quality.leastAngle * kDegrees;
    json["mean_least_angle_degrees"] = quality.meanLeast * kDegrees;
    json["radius_ratio"] = quality.radiusRatio;
    json["valence_six"] = quality.valenceSix;
    json["shortest_edge"] = quality.shortestEdge;
    json["longest_edge"] = quality.longestEdge;
  }
  in.notes.detailsJson = json.dump();
  if (asksJson(in)) {
    in.output = printed(json);
    return value;
  }
  for (const auto& [key, entry] : json.items()) {
    if (key == "bounds" && !m.bounds.isEmpty())
      in.output += fmt::format("{:<22}{} to {}\n", key, coordinates(m.bounds.min),
                               coordinates(m.bounds.max));
    else
      in.output += fmt::format("{:<22}{}\n", key, figureText(entry));
  }
  return value;
}

Value compare(Invocation& in) {
  const levelset::CompareOptions options{.maxMemory = in.maxMemory, .progress = in.progress};
  const levelset::Comparison c =
      in.operands[0].kind() == Kind::Adaptive
          ? levelset::compare(in.operands[0].adaptive(), in.operands[1].adaptive(), options)
          : levelset::compare(in.band(0), in.band(1), options);
  Json json;
  json["hausdorff"] = c.hausdorff();
  json["hausdorff_a_to_b"] = c.hausdorffAtoB;
  json["hausdorff_b_to_a"] = c.hausdorffBtoA;
  json["mean_a_to_b"] = c.meanAtoB;
  json["mean_b_to_a"] = c.meanBtoA;
  json["chamfer"] = c.chamfer();
  json["symmetric_difference"] = c.symmetricDifference;
  in.notes.detailsJson = json.dump();
  if (asksJson(in)) {
    in.output = printed(json);
  } else {
    for (const auto& [key, entry] : json.items())
      in.output += fmt::format("{:<22}{:.9g}\n", key, entry.get<double>());
  }
  if (in.given("tolerance")) {
    const double tolerance = in.length("tolerance");
    if (c.hausdorff() > tolerance)
      throw levelset::NumericalError(
          fmt::format("compare: the Hausdorff distance of the surfaces is {:.6g}, more than the "
                      "tolerance of {:.6g}; see the figures above, or raise --tolerance",
                      c.hausdorff(), tolerance));
  }
  return in.operands[1];
}

Value check(Invocation& in) {
  const levelset::CheckReport report = levelset::check(in.band(), in.progress);
  Json json;
  json["passed"] = report.passed();
  json["items"] = Json::array();
  std::string failed;
  for (const levelset::CheckItem& item : report.items) {
    json["items"].push_back(
        {{"name", item.name}, {"passed", item.passed}, {"detail", item.detail}});
    if (!asksJson(in)) {
      in.output += fmt::format("{:<6}{}{}{}\n", item.passed ? "ok" : "FAIL", item.name,
                               item.detail.empty() ? "" : ": ", item.detail);
    }
    if (!item.passed && failed.empty())
      failed = item.name + (item.detail.empty() ? "" : " (" + item.detail + ")");
  }
  json["eikonal_mean"] = report.eikonalMean;
  json["eikonal_max"] = report.eikonalMax;
  in.notes.detailsJson = json.dump();
  in.notes.errors.push_back({"eikonal residual, mean", report.eikonalMean, ""});
  if (asksJson(in))
    in.output = printed(json);
  else
    in.output += fmt::format("eikonal residual: mean {:.3g}, largest {:.3g}\n", report.eikonalMean,
                             report.eikonalMax);
  if (!report.passed()) {
    throw levelset::NumericalError(fmt::format(
        "check: the level set fails this check: {}; rebuild it with 'resample', or from its mesh",
        failed));
  }
  return in.operands[0];
}

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
                  "nii, mha, nrrd, mrc, pdb, cif, asc, hgt, flt, bil and lst",
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
    const render::Scene& scene = value.scene().scene;
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

std::optional<Cost> costOfMeasure(Invocation& in) {
  // With --sharp, the extended mesh and its crossings come on top.
  return in.flag("sharp") ? costPerVoxel(1000, 160, 800)(in) : costPerVoxel(720, 130, 520)(in);
}

void validateMeasure(const Invocation& in) {
  if (in.given("above") && !isTerrain(in))
    throw levelset::UsageError("measure: --above is for terrains; leave it out");
  if (!in.flag("sharp") || in.operands.empty() || in.operands[0].kind() == Kind::Band) return;
  throw levelset::UsageError(
      fmt::format("measure: --sharp is for level sets, but the operand is a {}; leave it out",
                  kindName(in.operands[0].kind())));
}

std::optional<Cost> costOfCompare(Invocation& in) {
  if (in.operands[0].kind() == Kind::Adaptive) return {};
  return costPerVoxel(1500, 60)(in);
}

}  // namespace

Operator measureOperator() {
  return {
      .name = "measure",
      .group = "Inspection",
      .summary =
          "measure volume, area, bounds, topology, centroid, inertia and mean curvature of a solid",
      .details =
          "Inertia is about the centroid for density 1; mean_curvature is the integral of "
          "(k1 + k2) / 2 over the surface; euler is V - E + F of the surface. For a mesh, "
          "radius_ratio is the mean of 2 r / R of its triangles, with the radii of the inscribed "
          "and "
          "the circumscribed circle, and valence_six the share of vertices with six triangles. For "
          "a "
          "segmentation, materials has the volume and the area of each region, interfaces the area "
          "between each pair of regions, and junction_length the length of the curves where three "
          "regions meet. Sheets have the same label on both sides; sheet_area is their area and "
          "rim_length the length of their borders. A level set rounds sharp edges by half a voxel² "
          "of the cross-section; --sharp measures the solid with the edges that its distances "
          "imply. For a terrain, area and volumes are those of its triangles: volume_above lies "
          "between the ground and a horizontal plane where the ground is above it, volume_below "
          "where it is below. Slopes are in degrees.",
      .example = "levelsmith sphere --radius 1 --voxel 0.05 ! measure --json",
      .params = {{.name = "sharp",
                  .type = ParamType::Flag,
                  .doc =
                      "reconstruct the sharp edges and corners that the distances of a level set "
                      "imply"},
                 {.name = "above",
                  .type = ParamType::Number,
                  .doc = "for terrains: height of the plane from which volumes are measured; "
                         "default: 0"},
                 jsonParam()},
      .operands = {{Kind::Band, Kind::Mesh, Kind::Adaptive, Kind::Segmentation, Kind::Terrain}},
      .flow = Flow::PassesThrough,
      .run = measure,
      .cost = costOfMeasure,
      .validate = validateMeasure,
      .usesStandardOutput = asksJson,
  };
}

Operator compareOperator() {
  return {
      .name = "compare",
      .group = "Inspection",
      .summary =
          "measure the difference of two solids: Hausdorff, mean and Chamfer distance, volume",
      .details =
          "Both solids stay on the stack. hausdorff is the larger of the two directed distances, "
          "chamfer the sum of the two means, symmetric_difference the volume inside exactly one of "
          "the solids. The grids may differ. Two adaptive fields are compared by their meshes. An "
          "adaptive field is compared with a level set after 'to-band'.",
      .example =
          "levelsmith sphere --radius 1 --voxel 0.05 ! sphere --radius 1 --center 0.1,0,0 "
          "--voxel 0.05 ! compare --tolerance 0.11",
      .params = {{.name = "tolerance",
                  .type = ParamType::Length,
                  .doc =
                      "largest accepted Hausdorff distance; if it is exceeded, the exit code is 5",
                  .range = Range::NonNegative},
                 jsonParam()},
      .operands = {{Kind::Band, Kind::Adaptive}, {Kind::Band, Kind::Adaptive}},
      .flow = Flow::PassesThrough,
      .run = compare,
      .cost = costOfCompare,
      .validate = requireOneKind,
      .usesStandardOutput = asksJson,
  };
}

Operator checkOperator() {
  return {
      .name = "check",
      .group = "Inspection",
      .summary =
          "check the values, signs and gradients of a level set; exit code 5 if a check fails",
      .example = "levelsmith box --size 1,1,1 --voxel 0.05 ! check",
      .params = {jsonParam()},
      .operands = {{Kind::Band}},
      .flow = Flow::PassesThrough,
      .run = check,
      .cost = costPerVoxel(75),
      .usesStandardOutput = asksJson,
  };
}

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
