#include "apps/pipeline/operators/solids/segment_actions.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "levelset/segmented/extract_label.h"
#include "levelset/segmented/measure_segmented.h"
#include "levelset/segmented/segment_labels.h"
#include "levelset/segmented/segment_solids.h"
#include "levelset/segmented/segmented_to_mesh.h"

namespace pipeline {
namespace {

using levelset::RegionLabel;
using levelset::SegmentedField;
using levelset::UsageError;

bool isLabelVolume(const Invocation& in) {
  return !in.operands.empty() && in.operands[0].kind() == Kind::Volume;
}

RegionLabel labelFrom(double number, const Invocation& in, const char* param) {
  if (!(number >= 1) || number > 65535 || number != std::floor(number))
    throw UsageError(fmt::format("{}: {} is not a label; give an integer from 1 to 65535",
                                 in.where(param), number));
  return static_cast<RegionLabel>(number);
}

std::string placeText(const Imath::V3d& p) {
  return fmt::format("{:.4g},{:.4g},{:.4g}", p.x, p.y, p.z);
}

/// Puts the thin and the covered regions into the certificate and the warnings.
void reportRegions(const levelset::SegmentSolidsResult& result, Invocation& in) {
  Json thin = Json::array();
  for (const levelset::ThinPart& part : result.thinParts) {
    thin.push_back({{"label", part.label},
                    {"places", part.places},
                    {"lost", part.isLost},
                    {"thickness", part.thickness},
                    {"position", {part.position.x, part.position.y, part.position.z}}});
    in.notes.warnings.push_back(fmt::format(
        "region {} is thinner than a voxel at {} places, {:.3g} at {}{}; use a smaller --voxel",
        part.label, part.places, part.thickness, placeText(part.position),
        part.isLost ? ", and has holes there" : ""));
  }
  for (const RegionLabel label : result.vanished)
    in.notes.warnings.push_back(fmt::format(
        "region {} is empty: later solids cover it, or it is thinner than a voxel", label));
  in.notes.certificateJson =
      Json{{"labels", result.field.labels()}, {"vanished", result.vanished}, {"thin", thin}}.dump();
  in.notes.notes.insert(in.notes.notes.end(), result.notes.begin(), result.notes.end());
}

Value segment(Invocation& in) {
  if (isLabelVolume(in)) {
    const levelset::Volume& volume = in.operands[0].volume();
    return Value(
        levelset::segmentLabels(volume, {.smooth = in.given("smooth") ? in.number("smooth") : 0,
                                         .maxMemory = in.maxMemory,
                                         .progress = in.progress}));
  }
  levelset::SegmentSolidsOptions options{
      .halfWidth = in.number("half-width"), .maxMemory = in.maxMemory, .progress = in.progress};
  if (in.given("labels"))
    for (const double number : in.numbers("labels"))
      options.labels.push_back(labelFrom(number, in, "labels"));
  std::vector<levelset::NarrowBand> solids;
  for (const Value& operand : in.operands) solids.push_back(operand.band());
  const levelset::SegmentSolidsResult result = levelset::segmentSolids(solids, options);
  reportRegions(result, in);
  return Value(result.field);
}

void validateSegment(const Invocation& in) {
  for (const Value& operand : in.operands)
    if (isLabelVolume(in) && in.operands.size() > 1)
      throw UsageError(fmt::format(
          "segment: takes level sets, or one volume of labels, not {} values with a {}; name the "
          "operands with '@'",
          in.operands.size(), kindName(operand.kind())));
  if (isLabelVolume(in))
    for (const char* name : {"labels", "half-width"})
      if (in.given(name))
        throw UsageError(fmt::format(
            "segment: --{} is for level sets, but the operand is a volume; leave it out", name));
  if (!isLabelVolume(in) && in.given("smooth"))
    throw UsageError(
        "segment: --smooth is for a volume of labels, but the operand is a level set; leave it "
        "out");
  if (in.given("labels")) {
    const std::size_t count = in.numbers("labels").size();
    if (!in.operands.empty() && count != in.operands.size())
      throw UsageError(
          fmt::format("segment: --labels has {} labels for {} level sets; give one "
                      "for each",
                      count, in.operands.size()));
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
  plan.halfWidth = isLabelVolume(in) ? 2 : in.number("half-width");
  plan.kind = Kind::Band;  // as large as a band of this half width
  plan.fieldBytes = plan.bytes();
  plan.kind = Kind::Segmentation;
  return plan;
}

Value extract(Invocation& in) {
  const RegionLabel label = labelFrom(static_cast<double>(in.integer("label")), in, "label");
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

Json measuresOf(const SegmentedField& field, const Invocation& in) {
  const levelset::SegmentedMeasurement m =
      levelset::measureSegmented(field, {.maxMemory = in.maxMemory, .progress = in.progress});
  Json json;
  json["volume"] = m.volume;
  json["area"] = m.area;
  json["voxel_size"] = field.voxelSize();
  json["half_width"] = field.halfWidth();
  json["active_voxels"] = field.activeVoxelCount();
  json["materials"] = Json::array();
  for (const levelset::RegionMeasure& region : m.regions)
    if (region.label != levelset::kVoid)
      json["materials"].push_back(
          {{"label", region.label}, {"volume", region.volume}, {"area", region.area}});
  json["interfaces"] = Json::array();
  for (const levelset::InterfaceMeasure& interface : m.interfaces)
    json["interfaces"].push_back(
        {{"labels", {interface.sides.front, interface.sides.behind}}, {"area", interface.area}});
  json["junction_length"] = m.junctionLength;
  json["junction_points"] = m.junctionPoints;
  json["triangles"] = m.triangles;
  return json;
}

Value meshOfSegmentation(const Invocation& in) {
  levelset::SegmentedMesh all = levelset::segmentedToMesh(
      in.operands[0].segmentation(), {.maxMemory = in.maxMemory, .progress = in.progress});
  if (!in.given("label")) return Value(std::move(all.mesh));
  const RegionLabel label = labelFrom(static_cast<double>(in.integer("label")), in, "label");
  levelset::TriMesh surface = regionSurface(all, label);
  if (surface.isEmpty())
    throw levelset::InvalidInput(
        fmt::format("the segmentation has no region {}; 'info' lists its labels", label));
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
          "point, as an atlas does; its interfaces lie half way between different labels. "
          "'extract' turns a region into a level set again.",
      .example =
          "levelsmith box --size 4,4,2 --voxel 0.1 ! sphere --radius 1.2 --voxel 0.1 ! segment ! "
          "measure --json",
      .params = {{.name = "labels",
                  .type = ParamType::Numbers,
                  .doc = "labels of the solids, integers from 1 to 65535; default: 1,2,3,…"},
                 {.name = "smooth",
                  .type = ParamType::Number,
                  .doc = "for a volume of labels: standard deviation in voxels, up to 3, by which "
                         "the interfaces are smoothed; default: they follow the faces between the "
                         "grid points",
                  .range = Range::NonNegative},
                 {.name = "half-width",
                  .type = ParamType::Number,
                  .doc = "for solids: largest stored distance from an interface, in voxels, at "
                         "least 2",
                  .fallback = "2",
                  .range = Range::Positive}},
      .operands = {{Kind::Band, Kind::Volume}},
      .takesMore = true,
      .takesStack = true,
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
