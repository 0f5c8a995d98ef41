#include "apps/pipeline/operators/solids/segment_edit_actions.h"

#include <fmt/core.h>

#include <algorithm>
#include <exception>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/operators/kind_variant.h"
#include "apps/pipeline/operators/label_params.h"
#include "apps/pipeline/operators/level_set_operator.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "levelset/segmented/operators/edit_segmented.h"
#include "levelset/segmented/operators/morph_segmented.h"
#include "levelset/segmented/operators/offset_region.h"
#include "levelset/segmented/operators/smooth_segmented.h"
#include "levelset/segmented/place_segmented.h"
#include "levelset/transform/transform.h"

namespace pipeline {
namespace {

using levelset::RegionLabel;
using levelset::UsageError;

/// Behaviour of an action on segmentations.
struct SegmentedAction {
  std::string details;                   ///< for the help
  std::vector<Param> params = {};        ///< that only segmentations have
  std::vector<std::string> shared = {};  ///< other options that segmentations have too
  std::vector<std::string> needed = {};  ///< options that must be given
  bool takesSolids = false;              ///< the further operands are level sets
  std::function<void(const Invocation&)> validate = {};
  std::function<Value(Invocation&)> run;
};

void checkSegmented(const SegmentedAction& action, const Invocation& in) {
  for (std::size_t i = 1; i < in.operands.size(); ++i) {
    const Kind wanted = action.takesSolids ? Kind::Band : Kind::Segmentation;
    if (in.operands[i].kind() != wanted)
      throw UsageError(
          fmt::format("{}: operand 1 is a segmentation, so operand {} must be {}, but it is {}",
                      in.op().name, i + 1, kindPhrase(wanted), kindPhrase(in.operands[i].kind())));
  }
  const auto isOne = [](const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  for (const Param& param : in.op().params) {
    const bool isOwn = std::any_of(action.params.begin(), action.params.end(),
                                   [&](const Param& p) { return p.name == param.name; });
    if (in.given(param.name) && !isOwn && !isOne(action.shared, param.name))
      throw UsageError(fmt::format("{}: --{} does not apply to a segmentation; leave it out",
                                   in.op().name, param.name));
  }
  for (const std::string& name : action.needed)
    if (!in.given(name))
      throw UsageError(fmt::format("{}: a segmentation needs --{}; give it", in.op().name, name));
  if (action.validate) action.validate(in);
}

/// Refuses the options of segmentations with other operands.
void refuseForOthers(const std::vector<Param>& own, const Invocation& in) {
  if (in.operands.empty() || isFirstOperand(Kind::Segmentation, in)) return;
  for (const Param& param : own)
    if (in.given(param.name))
      throw UsageError(
          fmt::format("{}: --{} is for a segmentation, but the operand is {}; leave it out",
                      in.op().name, param.name, kindPhrase(in.operands[0].kind())));
}

/// Lets an action on level sets take segmentations too.
Operator alsoOfSegmentations(Operator op, SegmentedAction action) {
  op.operands[0].push_back(Kind::Segmentation);
  if (!action.takesSolids)
    for (std::size_t i = 1; i < op.operands.size(); ++i)
      op.operands[i].push_back(Kind::Segmentation);
  op.details += (op.details.empty() ? "" : " ") + action.details;
  op.params.insert(op.params.end(), action.params.begin(), action.params.end());
  return withVariant(
      std::move(op),
      {.kind = Kind::Segmentation,
       .run = action.run,
       .validate = [action](const Invocation& in) { checkSegmented(action, in); },
       .validateAny = [own = action.params](const Invocation& in) { refuseForOthers(own, in); },
       .keepsSize = true});
}

Param labelParam(const char* doc) {
  return {.name = "label", .type = ParamType::Text, .doc = doc};
}
Param overParam(const char* doc) {
  return {.name = "over", .type = ParamType::Text, .doc = doc};
}
RegionLabel givenLabel(const Invocation& in) {
  return regionLabel(in.text("label"), VoidLabel::IsNone, in, "label");
}
levelset::EditSegmentedOptions editOptions(const Invocation& in) {
  levelset::EditSegmentedOptions options{.maxMemory = in.maxMemory, .progress = in.progress};
  if (in.given("over") && in.text("over") != "all")
    options.over = regionLabels(in, "over", VoidLabel::Counts);
  return options;
}
void checkOver(const Invocation& in) {
  (void)editOptions(in);
}

Value addSolids(Invocation& in) {
  levelset::SegmentedField field = in.operands[0].segmentation();
  for (std::size_t i = 1; i < in.operands.size(); ++i)
    field = addSolid(field, in.band(i), givenLabel(in), editOptions(in));
  return Value(field);
}
Value cutSolids(Invocation& in) {
  levelset::SegmentedField field = in.operands[0].segmentation();
  for (std::size_t i = 1; i < in.operands.size(); ++i)
    field = cut(field, in.band(i), editOptions(in));
  return Value(field);
}

Value offsetOneRegion(Invocation& in) {
  return Value(offsetRegion(in.operands[0].segmentation(), givenLabel(in), in.length("distance"),
                            {.cost = in.text("cost") == "void" ? levelset::OffsetCost::Void
                                                               : levelset::OffsetCost::Neighbours,
                             .maxMemory = in.maxMemory,
                             .progress = in.progress}));
}

Value flowRegions(Invocation& in) {
  levelset::SmoothSegmentedOptions options{.keepsVolumes = in.flag("volume-preserving"),
                                           .maxMemory = in.maxMemory,
                                           .progress = in.progress};
  if (in.given("fixed")) options.fixed = regionLabels(in, "fixed", VoidLabel::Counts);
  const levelset::SmoothSegmentedResult result =
      smoothSegmented(in.operands[0].segmentation(), in.number("time"), options);
  Json vanished = Json::array();
  for (const levelset::VanishedRegion& region : result.vanished) {
    vanished.push_back({{"label", region.label}, {"time", region.time}});
    in.notes.warnings.push_back(
        fmt::format("region {} has vanished at the time {:.4g}", region.label, region.time));
  }
  Json details{{"steps", result.steps}, {"vanished", vanished}};
  if (options.keepsVolumes) {
    details["volume_error"] = result.volumeError;
    constexpr double kWarned = 1e-3;
    if (result.volumeError > kWarned)
      in.notes.warnings.push_back(
          fmt::format("a volume changes by {:.2g} of its size, because the pressures that keep "
                      "the volumes were not found; use smaller voxels",
                      result.volumeError));
  }
  in.notes.detailsJson = details.dump();
  return Value(result.field);
}

/// Fraction at which a morph ends.
double fractionOf(const Invocation& in) {
  const std::string text = in.text("until");
  if (text == "converged") return 1;
  std::size_t end = 0;
  double fraction = -1;
  try {
    fraction = std::stod(text, &end);
  } catch (const std::exception&) {
    end = 0;
  }
  if (end != text.size() || !(fraction > 0 && fraction <= 1))
    throw UsageError(
        fmt::format("{}: '{}' is not a fraction above 0 and up to 1", in.where("until"), text));
  return fraction;
}
Value morphRegions(Invocation& in) {
  return Value(morphSegmented(in.operands[0].segmentation(), in.operands[1].segmentation(),
                              fractionOf(in),
                              {.maxMemory = in.maxMemory, .progress = in.progress}));
}

/// New labels of `relabel`: OLD=NEW.
std::map<RegionLabel, RegionLabel> newLabels(const Invocation& in) {
  std::map<RegionLabel, RegionLabel> labels;
  for (const std::string& word : labelWords(in, "labels")) {
    const std::size_t sign = word.find('=');
    if (sign == std::string::npos)
      throw UsageError(fmt::format("{}: '{}' is not OLD=NEW; give pairs of labels, as in 1=3,2=0",
                                   in.where("labels"), word));
    const RegionLabel old = regionLabel(word.substr(0, sign), VoidLabel::IsNone, in, "labels"),
                      next = regionLabel(word.substr(sign + 1), VoidLabel::Counts, in, "labels");
    if (!labels.emplace(old, next).second)
      throw UsageError(
          fmt::format("{}: label {} has two new labels; give one", in.where("labels"), old));
  }
  return labels;
}

Value placeRegions(Invocation& in) {
  using Transform = levelset::TransformOperator;
  return Value(
      placeSegmented(in.operands[0].segmentation(),
                     Transform::matrixOf(readOptions<Transform::Options>(in, OptionStage::Run))));
}
void checkPlacement(const Invocation& in) {
  using Transform = levelset::TransformOperator;
  Invocation probe = in;
  Transform::check(readOptions<Transform::Options>(probe, OptionStage::Syntax),
                   {[&in](std::string_view name) { return in.given(std::string(name)); }, true});
}

}  // namespace

Operator transformWithSegmentations(Operator op) {
  op.summary = "move, turn, scale or mirror a solid, a mesh, a point cloud or a segmentation";
  return alsoOfSegmentations(
      std::move(op),
      {.details = "A segmentation moves exactly, too, and cannot be mirrored, sheared or scaled "
                  "unevenly.",
       .shared = {"matrix", "translate", "rotate", "axis", "scale", "mirror", "about"},
       .validate = checkPlacement,
       .run = placeRegions});
}

Operator unionWithSegmentations(Operator op) {
  return alsoOfSegmentations(
      std::move(op),
      {.details = "A segmentation as the first operand gives the space of the level sets after it "
                  "to the region --label, which may be new. --over names the regions that lose "
                  "space.",
       .params = {labelParam("for a segmentation: label of the region that gets the space of the "
                             "level sets, from 1 to 65535"),
                  overParam("for a segmentation: labels of the regions that lose space, separated "
                            "by commas; 0 or void: the void; default: all")},
       .shared = {},
       .needed = {"label"},
       .takesSolids = true,
       .validate =
           [](const Invocation& in) {
             (void)givenLabel(in);
             checkOver(in);
           },
       .run = addSolids});
}

Operator differenceWithSegmentations(Operator op) {
  return alsoOfSegmentations(
      std::move(op),
      {.details = "A segmentation as the first operand loses the space of the level sets after "
                  "it, which becomes void.",
       .params = {overParam("for a segmentation: labels of the regions that lose space, separated "
                            "by commas; default: all")},
       .shared = {},
       .needed = {},
       .takesSolids = true,
       .validate = checkOver,
       .run = cutSolids});
}

Operator offsetWithSegmentations(Operator op) {
  return alsoOfSegmentations(
      std::move(op),
      {.details = "Of a segmentation, one region grows or shrinks. --cost void takes the space "
                  "from the void only, or gives it to the void.",
       .params = {labelParam("for a segmentation: label of the region that is offset"),
                  {.name = "cost",
                   .type = ParamType::Choice,
                   .doc = "for a segmentation: regions that lose space to the region, or get it "
                          "where the region shrinks; neighbours: all, with the void",
                   .fallback = "neighbours",
                   .choices = {"neighbours", "void"}}},
       .shared = {"distance"},
       .needed = {"label", "distance"},
       .validate = [](const Invocation& in) { (void)givenLabel(in); },
       .run = offsetOneRegion});
}

Operator flowWithSegmentations(Operator op) {
  return alsoOfSegmentations(
      std::move(op),
      {.details = "In a segmentation all interfaces move. Three regions meet at 120 degrees. With "
                  "--volume-preserving each region keeps its volume, as bubbles do.",
       .params = {{.name = "fixed",
                   .type = ParamType::Text,
                   .doc = "for a segmentation: labels of regions that do not move, separated by "
                          "commas; 0 or void: the void"}},
       .shared = {"time", "volume-preserving"},
       .needed = {},
       .validate =
           [](const Invocation& in) {
             if (in.given("fixed")) (void)regionLabels(in, "fixed", VoidLabel::Counts);
           },
       .run = flowRegions});
}

Operator morphWithSegmentations(Operator op) {
  return alsoOfSegmentations(
      std::move(op),
      {.details = "Two segmentations are matched by their labels; the result is the partition at "
                  "the fraction --until.",
       .shared = {"until"},
       .needed = {"until"},
       .validate = [](const Invocation& in) { (void)fractionOf(in); },
       .run = morphRegions});
}

Operator relabelOperator() {
  return {
      .name = "relabel",
      .group = "Solids",
      .summary = "give regions of a segmentation new labels, merge them or remove them",
      .details =
          "Regions with the same new label become one. Regions with the new label 0 become "
          "void.",
      .example =
          "levelsmith box --size 4,4,2 --voxel 0.1 ! sphere --radius 1.2 --voxel 0.1 ! segment ! "
          "relabel 2=0 ! measure --json",
      .params = {{.name = "labels",
                  .type = ParamType::Text,
                  .doc = "pairs OLD=NEW of labels, separated by commas, as in 1=3,2=0",
                  .required = true,
                  .position = 0}},
      .operands = {{Kind::Segmentation}},
      .resultKind = [](const Invocation&) { return Kind::Segmentation; },
      .run =
          [](Invocation& in) {
            return Value(relabel(in.operands[0].segmentation(), newLabels(in),
                                 {.maxMemory = in.maxMemory, .progress = in.progress}));
          },
      .validate = [](const Invocation& in) { (void)newLabels(in); },
  };
}

}  // namespace pipeline
