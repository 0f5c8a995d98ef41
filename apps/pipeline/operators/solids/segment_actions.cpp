#include "apps/pipeline/operators/solids/segment_actions.h"

#include <fmt/core.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/label_params.h"
#include "apps/pipeline/operators/solids/sheet_report.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/segmented/meshing/extract_label.h"
#include "levelset/segmented/meshing/measure_segmented.h"
#include "levelset/segmented/meshing/segmented_to_mesh.h"
#include "levelset/segmented/segment_labels.h"
#include "levelset/segmented/segment_solids.h"
#include "levelset/segmented/sources/segment_mesh.h"

namespace pipeline {
namespace {

using levelset::RegionLabel;
using levelset::SegmentedField;
using levelset::UsageError;

Kind kindOfParts(const Invocation& in) {
  return in.operands.empty() ? Kind::Band : in.operands[0].kind();
}

std::string placeText(const Imath::V3d& p) {
  return fmt::format("{:.4g},{:.4g},{:.4g}", p.x, p.y, p.z);
}

/// Puts the thin and the empty regions into the certificate and the warnings.
void reportRegions(const SegmentedField& field, const std::vector<levelset::ThinPart>& thinParts,
                   const std::vector<RegionLabel>& vanished, Invocation& in) {
  const std::string remedy =
      kindOfParts(in) == Kind::Volume ? "give a finer volume" : "use a smaller --voxel";
  Json thin = Json::array();
  for (const levelset::ThinPart& part : thinParts) {
    thin.push_back({{"label", part.label},
                    {"places", part.places},
                    {"lost", part.isLost},
                    {"thickness", part.thickness},
                    {"position", {part.position.x, part.position.y, part.position.z}}});
    in.notes.warnings.push_back(
        fmt::format("region {} is thinner than a voxel at {} place{}, {:.3g} at {}{}; {}",
                    part.label, part.places, part.places == 1 ? "" : "s", part.thickness,
                    placeText(part.position), part.isLost ? ", and has holes there" : "", remedy));
  }
  for (const RegionLabel label : vanished)
    in.notes.warnings.push_back(fmt::format(
        "region {} is empty: later solids cover it, or it is thinner than a voxel", label));
  in.notes.certificateJson =
      Json{{"labels", field.labels()}, {"vanished", vanished}, {"thin", thin}}.dump();
}

Value segmentByMesh(Invocation& in) {
  const levelset::SegmentMeshResult result =
      levelset::segmentMesh(in.mesh(), in.voxelSize(in.operands[0].plan().estimate().longestSide()),
                            {.halfWidth = in.number("half-width"),
                             .keepsSheets = in.flag("sheets"),
                             .maxMemory = in.maxMemory,
                             .progress = in.progress});
  in.notes.notes.push_back(
      fmt::format("the mesh has {} patches between its junctions, and encloses "
                  "{} regions",
                  result.patches, result.field.labels().size()));
  if (in.flag("sheets"))
    reportSheets(result, in);
  else
    reportRegions(result.field, levelset::thinParts(result.field), {}, in);
  return Value(result.field);
}

Value segmentByLabels(Invocation& in) {
  const SegmentedField field = levelset::segmentLabels(
      in.operands[0].volume(), {.smooth = in.given("smooth") ? in.number("smooth") : 0,
                                .maxMemory = in.maxMemory,
                                .progress = in.progress});
  reportRegions(field, levelset::thinParts(field), {}, in);
  return Value(field);
}

Value segment(Invocation& in) {
  if (kindOfParts(in) == Kind::Volume) return segmentByLabels(in);
  if (kindOfParts(in) == Kind::Mesh) return segmentByMesh(in);
  levelset::SegmentSolidsOptions options{
      .halfWidth = in.number("half-width"), .maxMemory = in.maxMemory, .progress = in.progress};
  if (in.given("labels")) options.labels = regionLabels(in, "labels", VoidLabel::IsNone);
  std::vector<levelset::NarrowBand> solids;
  for (const Value& operand : in.operands) solids.push_back(operand.band());
  const levelset::SegmentSolidsResult result = levelset::segmentSolids(solids, options);
  reportRegions(result.field, result.thinParts, result.vanished, in);
  in.notes.notes.insert(in.notes.notes.end(), result.notes.begin(), result.notes.end());
  return Value(result.field);
}

/// Refuses an option that the operands do not have.
void refuseFor(const Invocation& in, const char* option, const char* have) {
  if (in.given(option))
    throw UsageError(fmt::format("segment: --{} is for {}, but the operand is {}; leave it out",
                                 option, have, kindPhrase(kindOfParts(in))));
}

void validateSegment(const Invocation& in) {
  const Kind kind = kindOfParts(in);
  for (const Value& operand : in.operands)
    if (operand.kind() != kind)
      throw UsageError(
          fmt::format("segment: the operands are {} and {}; give level sets, or one volume of "
                      "labels, or one mesh",
                      kindPhrase(kind), kindPhrase(operand.kind())));
  if (kind != Kind::Band && in.operands.size() > 1)
    throw UsageError(fmt::format("segment: takes one {}, not {}; name it with '@'", kindName(kind),
                                 in.operands.size()));
  if (kind != Kind::Volume) refuseFor(in, "smooth", "a volume of labels");
  if (kind != Kind::Band) refuseFor(in, "labels", "level sets");
  if (kind == Kind::Volume) refuseFor(in, "half-width", "level sets and meshes");
  if (kind == Kind::Mesh) {
    in.requireVoxelSize();
  } else {
    refuseFor(in, "sheets", "a mesh");
    refuseFor(in, "voxel", "a mesh");
    refuseFor(in, "resolution", "a mesh");
  }
  if (in.given("labels") && !in.operands.empty()) {
    const std::size_t count = regionLabels(in, "labels", VoidLabel::IsNone).size();
    if (count != in.operands.size())
      throw UsageError(
          fmt::format("segment: --labels has {} labels for {} level set{}; give one for each",
                      count, in.operands.size(), in.operands.size() == 1 ? "" : "s"));
  }
}

Plan planSegment(Invocation& in) {
  Plan plan = in.operands[0].plan();
  plan.area = 0;
  for (const Value& operand : in.operands) {
    plan.bounds.extendBy(operand.plan().bounds);
    plan.area += operand.plan().area;
    if (operand.plan().voxelSize > 0)
      plan.voxelSize = std::min(plan.voxelSize, operand.plan().voxelSize);
  }
  if (kindOfParts(in) == Kind::Mesh) plan.voxelSize = in.voxelSize(plan.estimate().longestSide());
  plan.triangles = 0;
  plan.halfWidth = in.number("half-width");
  plan.kind = Kind::Band;  // as large as a band of this half width
  plan.fieldBytes = plan.bytes();
  plan.kind = Kind::Segmentation;
  return plan;
}

Value extract(Invocation& in) {
  const RegionLabel label =
      regionLabel(std::to_string(in.integer("label")), VoidLabel::IsNone, in, "label");
  const SegmentedField& field = in.operands[0].segmentation();
  const std::vector<RegionLabel> labels = field.labels();
  if (!std::binary_search(labels.begin(), labels.end(), label)) {
    constexpr std::size_t kMost = 20;
    std::string known;
    for (std::size_t i = 0; i < std::min(labels.size(), kMost); ++i)
      known += (i ? ", " : "") + std::to_string(labels[i]);
    throw levelset::InvalidInput(
        fmt::format("the segmentation has no region {}; its labels are {}{}", label, known,
                    labels.size() > kMost ? ", …" : ""));
  }
  noteLostSheets(field, label, "a level set", in.notes);
  return Value(levelset::extractLabel(
      field, label,
      {.halfWidth = in.number("half-width"), .maxMemory = in.maxMemory, .progress = in.progress}));
}

Plan planExtract(Invocation& in) {
  Plan plan = in.operands[0].plan();
  plan.kind = Kind::Band;
  plan.fieldBytes = 0;
  plan.halfWidth = in.number("half-width");
  return plan;
}

}  // namespace

namespace {

Json boxJson(const Imath::Box3d& box) {
  if (box.isEmpty()) return nullptr;
  return {{"min", {box.min.x, box.min.y, box.min.z}}, {"max", {box.max.x, box.max.y, box.max.z}}};
}

}  // namespace

Json measuresOf(const SegmentedField& field, const Invocation& in) {
  const levelset::SegmentedMesh mesh =
      levelset::segmentedToMesh(field, {.maxMemory = in.maxMemory, .progress = in.progress});
  const levelset::SegmentedMeasurement m = levelset::measureSegmented(mesh);
  Json json;
  // Topology of the surface of all regions together.
  levelset::TriMesh outer;
  outer.positions = mesh.mesh.positions;
  Imath::Box3d bounds;
  for (std::size_t t = 0; t < mesh.sides.size(); ++t)
    if (mesh.sides[t].front == levelset::kVoid) {
      if (mesh.sides[t].behind != levelset::kVoid)
        outer.triangles.push_back(mesh.mesh.triangles[t]);
      for (const std::uint32_t corner : mesh.mesh.triangles[t])
        bounds.extendBy(mesh.mesh.positions[corner]);
    }
  const levelset::Measurement all = levelset::measure(outer);
  json["volume"] = m.volume;
  json["area"] = m.area;
  json["bounds"] = boxJson(bounds);
  json["components"] = all.components;
  json["shells"] = all.surfaces;
  json["cavities"] = all.cavities;
  json["euler"] = all.euler;
  json["voxel_size"] = field.voxelSize();
  json["half_width"] = field.halfWidth();
  json["active_voxels"] = field.activeVoxelCount();
  json["materials"] = Json::array();
  for (const levelset::RegionMeasure& region : m.regions)
    if (region.label != levelset::kVoid)
      json["materials"].push_back({{"label", region.label},
                                   {"volume", region.volume},
                                   {"area", region.area},
                                   {"bounds", boxJson(region.bounds)}});
  json["interfaces"] = Json::array();
  for (const levelset::InterfaceMeasure& interface : m.interfaces)
    json["interfaces"].push_back(
        {{"labels", {interface.sides.front, interface.sides.behind}}, {"area", interface.area}});
  json["junction_length"] = m.junctionLength;
  json["junction_points"] = m.junctionPoints;
  json["triangles"] = m.triangles;
  addSheetFigures(field, m, json);
  return json;
}

Value meshOfSegmentation(Invocation& in) {
  const SegmentedField& field = in.operands[0].segmentation();
  const levelset::SegmentedMeshOptions options{.maxMemory = in.maxMemory, .progress = in.progress};
  if (!in.given("label")) return Value(levelset::segmentedToMesh(field, options).mesh);
  const RegionLabel label =
      regionLabel(std::to_string(in.integer("label")), VoidLabel::IsNone, in, "label");
  levelset::TriMesh surface = levelset::regionSurface(field, label, options);
  if (surface.isEmpty())
    throw levelset::InvalidInput(
        fmt::format("the segmentation has no region {}; 'info' lists its labels", label));
  noteLostSheets(field, label, "its closed surface", in.notes);
  return Value(std::move(surface));
}

Operator segmentOperator() {
  return {
      .name = "segment",
      .group = "Solids",
      .summary =
          "make one partition of several solids, or of a volume of labels, without gaps or "
          "overlaps",
      .details =
          "The solids become regions 1, 2, 3 and so on; 0 is the void around them. Where solids "
          "overlap, the later one wins. Without named operands, all level sets on top of the stack "
          "are taken. Interfaces and the curves where three regions meet are as exact as the "
          "surfaces of the solids. The certificate in the report names regions that are covered by "
          "others or thinner than a voxel. A volume of labels holds one integer for each grid "
          "point, as an atlas does; its interfaces lie half way between different labels. A mesh "
          "in "
          "which three or more triangles share edges, as a box with walls, separates regions, "
          "which "
          "are numbered by decreasing volume. A mesh with borders is refused, unless --sheets "
          "keeps "
          "them. 'extract' turns a region into a level set again.",
      .example =
          "levelsmith box --size 4,4,2 --voxel 0.1 ! sphere --radius 1.2 --voxel 0.1 ! segment ! "
          "measure --json",
      .params = {{.name = "labels",
                  .type = ParamType::Text,
                  .doc = "labels of the solids, integers from 1 to 65535, separated by commas; "
                         "default: 1,2,3,…"},
                 {.name = "smooth",
                  .type = ParamType::Number,
                  .doc = "for a volume of labels: standard deviation in voxels, 0.5 to 3, by which "
                         "the interfaces are smoothed; default: they follow the faces between the "
                         "grid points",
                  .range = Range::NonNegative},
                 {.name = "half-width",
                  .type = ParamType::Number,
                  .doc = "for solids and meshes: largest stored distance from an interface, in "
                         "voxels, at least 2",
                  .fallback = "2",
                  .range = Range::Positive},
                 {.name = "sheets",
                  .type = ParamType::Flag,
                  .doc = "for a mesh: keep sheets, which have the same region on both sides, as a "
                         "wall with a door; the mesh may have borders and cross itself"},
                 voxelParam("for a mesh: voxel size, edge length of a voxel"),
                 resolutionParam()},
      .operands = {{Kind::Band, Kind::Volume, Kind::Mesh}},
      .takesMore = true,
      .takesStack = true,
      .takesVoxelSize = [](const Invocation& in) { return kindOfParts(in) == Kind::Mesh; },
      .resultKind = [](const Invocation&) { return Kind::Segmentation; },
      .run = segment,
      .plan = planSegment,
      .validate = validateSegment,
  };
}

Operator extractOperator() {
  return {
      .name = "extract",
      .group = "Solids",
      .summary = "turn one region of a segmentation into a level set",
      .example =
          "levelsmith box --size 4,4,2 --voxel 0.1 ! sphere --radius 1.2 --voxel 0.1 ! segment ! "
          "extract 1 ! mesh ! write outer.ply",
      .params = {{.name = "label",
                  .type = ParamType::Integer,
                  .doc = "label of the region",
                  .range = Range::Positive,
                  .required = true,
                  .position = 0},
                 halfWidthParam()},
      .operands = {{Kind::Segmentation}},
      .resultKind = [](const Invocation&) { return Kind::Band; },
      .run = extract,
      .plan = planExtract,
      .slope = Slope::One,
  };
}

}  // namespace pipeline
