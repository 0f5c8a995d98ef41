#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "apps/pipeline/graph/regions_of_interest.h"
#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/fields.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/csg/blend.h"
#include "levelset/csg/csg.h"
#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/flow/morph.h"
#include "levelset/solids/components.h"
#include "levelset/solids/morphology.h"
#include "levelset/solids/offset.h"

namespace pipeline {
namespace {

using levelset::CsgOperation;
using levelset::NarrowBand;

std::vector<NarrowBand> bands(const Invocation& in) {
  std::vector<NarrowBand> all;
  for (const Value& value : in.operands) all.push_back(value.band());
  return all;
}

RegionOfInterest roiOfCsg(Invocation& in, std::size_t, const RegionOfInterest& of) {
  const double voxel = in.planned->voxelSize;
  for (const Value& operand : in.operands)
    if (std::abs(operand.plan().voxelSize / voxel - 1) > 1e-9) return {};  // one is resampled
  return {.region = grown(of.region, seamReach(in.planned->halfWidth) * voxel)};
}

template <CsgOperation operation>
Value csg(Invocation& in) {
  levelset::CsgResult result =
      levelset::combine(operation, bands(in), {.maxMemory = in.maxMemory, .progress = in.progress});
  in.notes.notes = std::move(result.notes);
  return Value(std::move(result.band));
}

/// Of the box, that also lies in the other. 1 where it has no volume
double shareWithin(const Imath::Box3d& box, const Imath::Box3d& other) {
  double share = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double side = box.max[axis] - box.min[axis];
    if (!(side > 0)) return 1;
    const double common =
        std::min(box.max[axis], other.max[axis]) - std::max(box.min[axis], other.min[axis]);
    share *= std::clamp(common / side, 0.0, 1.0);
  }
  return share;
}

/// Surfaces as if spread evenly over their boxes, where the result can have some.
template <CsgOperation operation>
Plan planCsg(Invocation& in) {
  Plan plan = in.operands[0].plan();
  for (std::size_t i = 1; i < in.operands.size(); ++i) {
    const Plan other = in.operands[i].plan();
    plan.voxelSize = std::min(plan.voxelSize, other.voxelSize);
    plan.halfWidth = std::min(plan.halfWidth, other.halfWidth);
    if (operation == CsgOperation::Union) {
      plan.area += other.area;
      plan.bounds.extendBy(other.bounds);
      continue;
    }
    const double within = other.area * shareWithin(other.bounds, plan.bounds);
    if (operation == CsgOperation::Difference) {
      plan.area += within;
      continue;
    }
    plan.area = plan.area * shareWithin(plan.bounds, other.bounds) + within;
    plan.bounds.extendBy(other.bounds);  // which are estimates: what they share may be too little
  }
  return plan;
}

CsgOperation operationOf(const Invocation& in) {
  const std::string op = in.text("op");
  return op == "union"          ? CsgOperation::Union
         : op == "intersection" ? CsgOperation::Intersection
                                : CsgOperation::Difference;
}

Value blend(Invocation& in) {
  const std::string side = in.text("side");
  levelset::BlendOptions options{.maxMemory = in.maxMemory, .progress = in.progress};
  options.side = side == "add"      ? levelset::BlendSide::Add
                 : side == "remove" ? levelset::BlendSide::Remove
                                    : levelset::BlendSide::Both;
  if (in.text("method") == "fillet") options.method = levelset::BlendMethod::Fillet;
  if (in.given("reach")) options.reach = in.length("reach");
  levelset::CsgResult result =
      levelset::blend(operationOf(in), in.band(0), in.band(1), in.length("radius"), options);
  in.notes.notes = std::move(result.notes);
  return Value(std::move(result.band));
}

levelset::OffsetOptions offsetOptions(Invocation& in) {
  levelset::OffsetOptions options{.maxMemory = in.maxMemory, .progress = in.progress};
  if (in.given("half-width")) options.halfWidth = in.number("half-width");
  options.action = in.op().name.c_str();
  return options;
}

RegionOfInterest roiOfOffset(Invocation& in, std::size_t, const RegionOfInterest& of) {
  if (!in.given("distance") || in.given("mask")) return {};
  const double voxel = in.operands[0].plan().voxelSize;
  const double distance = in.length("distance");
  if (distance == 0) return {};
  const double reach = std::abs(distance) + levelset::distanceReach(in.planned->halfWidth) * voxel;
  return {.halfWidth = levelset::kReadBySurface, .region = grown(of.region, reach)};
}

void validateOffset(const Invocation& in) {
  if (in.given("distance") == in.given("by"))
    throw levelset::UsageError(
        in.given("by") ? "offset: a distance and --by exclude each other; leave one out"
                       : "offset: how far is missing; give a length, or --by and a field");
}

Value offset(Invocation& in) {
  levelset::OffsetOptions options = offsetOptions(in);
  // Of a narrower part as wide as of the whole: how far points travel shows in last bits.
  if (in.isPartial) options.halfWidth = in.planned->halfWidth;
  const std::optional<levelset::Mask> mask = maskOf(in);
  NarrowBand band = in.band();
  if (!mask && !in.given("by")) {
    const double distance = in.length("distance");
    in.operands.clear();
    return Value(levelset::offset(std::move(band), distance, options));
  }
  levelset::ScalarField length;
  if (in.given("by"))
    length = scalarField(in, "by");
  else
    length = [distance = in.length("distance")](const Imath::V3d&) { return distance; };
  if (mask) length = [length, mask](const Imath::V3d& p) { return mask->weight(p) * length(p); };
  in.operands.clear();
  return Value(levelset::offsetBy(std::move(band), length, options));
}

Plan planOffset(Invocation& in) {
  Plan plan = in.operands[0].plan();
  if (in.given("half-width")) plan.halfWidth = in.number("half-width");
  if (!in.given("distance")) return plan;  // a field may say anything
  const double distance = in.length("distance");
  const double before = plan.bounds.size().length();
  plan.bounds.min -= Imath::V3d(distance);
  plan.bounds.max += Imath::V3d(distance);
  const double after = plan.bounds.isEmpty() ? 0 : plan.bounds.size().length();
  if (before > 0) plan.area *= (after / before) * (after / before);
  return plan;
}

std::optional<Cost> costOfMoving(Invocation& in) {
  const Plan solid = in.operands[0].plan();
  const double way = in.given("distance") ? in.length("distance") / solid.voxelSize : 0;
  const double before = layerOf(solid), after = layerOf(*in.planned);
  Cost cost = costOfOffset(before, after, way, in.planned->halfWidth);
  // The lengths are looked up first, at the surface's own points.
  if (in.given("by") || in.given("mask")) {
    cost += costOfDistances(before, 12);
    cost.bytes += 60 * solid.activeVoxels();
  }
  return cost;
}

constexpr double kBeyondMoved = 8;  // voxels: what is further off counts as that far

/// What an operator makes of the operand, as far as --mask lets it.
/// @param moved  how far the surface goes, world units
template <typename Change>
Value masked(Invocation& in, double moved, const Change& change) {
  levelset::OffsetOptions options = offsetOptions(in);
  const std::optional<levelset::Mask> mask = maskOf(in);
  if (!mask) return Value(change(options));
  options.progress = levelset::subProgress(in.progress, 0, 0.5);
  const NarrowBand changed = change(options);
  NarrowBand result = levelset::morph(in.band(), changed,
                                      {.mask = mask,
                                       .farthest = moved / in.band().voxelSize() + kBeyondMoved,
                                       .maxMemory = in.maxMemory,
                                       .progress = levelset::subProgress(in.progress, 0.5, 0.9),
                                       .action = options.action});
  if (options.halfWidth)
    result = levelset::redistance(std::move(result),
                                  {.halfWidth = options.halfWidth,
                                   .maxMemory = in.maxMemory,
                                   .progress = levelset::subProgress(in.progress, 0.9, 1)});
  return Value(std::move(result));
}

Value open(Invocation& in) {
  return masked(in, in.length("radius"), [&](const levelset::OffsetOptions& options) {
    return levelset::opening(in.band(), in.length("radius"), options);
  });
}

Value close(Invocation& in) {
  return masked(in, in.length("radius"), [&](const levelset::OffsetOptions& options) {
    return levelset::closing(in.band(), in.length("radius"), options);
  });
}

/// Of a solid that is moved there and back again: both ways read what is beside them.
RegionOfInterest roiOfMorphology(Invocation& in, std::size_t, const RegionOfInterest& of) {
  if (in.given("mask")) return {};
  const Plan solid = in.operands[0].plan();
  const double there = levelset::distanceReach(solid.halfWidth),
               back = levelset::distanceReach(in.planned->halfWidth);
  const double reach = 2 * in.length("radius") + (there + back) * solid.voxelSize;
  return {.region = grown(of.region, reach)};
}

Plan planMorphology(Invocation& in) {
  Plan plan = in.operands[0].plan();
  if (in.given("half-width")) plan.halfWidth = in.number("half-width");
  return plan;
}

levelset::ShellSide shellSide(const Invocation& in) {
  const std::string side = in.text("side");
  return side == "out"    ? levelset::ShellSide::Out
         : side == "both" ? levelset::ShellSide::Both
                          : levelset::ShellSide::In;
}

Value shell(Invocation& in) {
  return masked(in, in.length("thickness"), [&](const levelset::OffsetOptions& options) {
    return levelset::shell(in.band(), in.length("thickness"), shellSide(in), options);
  });
}

RegionOfInterest roiOfShell(Invocation& in, std::size_t, const RegionOfInterest& of) {
  if (in.given("mask")) return {};
  const double width = in.planned->halfWidth, voxel = in.operands[0].plan().voxelSize;
  const double reach =
      in.length("thickness") + (levelset::distanceReach(width) + seamReach(width)) * voxel;
  return {.region = grown(of.region, reach)};
}

std::optional<Cost> costOfMorphology(Invocation& in) {
  if (in.given("mask")) return {};
  const Plan solid = in.operands[0].plan();
  const double layer = layerOf(solid), way = in.length("radius") / solid.voxelSize;
  Cost cost = costOfOffset(layer, layer, way, solid.halfWidth);
  cost += costOfOffset(layer, layer, way, in.planned->halfWidth);
  cost.bytes += solid.bytes();  // there, before it is back
  return cost;
}

std::optional<Cost> costOfShell(Invocation& in) {
  if (in.given("mask")) return {};
  const Plan solid = in.operands[0].plan();
  const double layer = layerOf(solid), way = in.length("thickness") / solid.voxelSize;
  const double width = in.planned->halfWidth;
  if (shellSide(in) != levelset::ShellSide::Both) return costOfOffset(layer, layer, way, width);
  Cost cost = costOfOffset(layer, layer, way / 2, width);
  return cost += costOfOffset(layer, layer, way / 2, width);
}

Plan planShell(Invocation& in) {
  Plan plan = planMorphology(in);
  const levelset::ShellSide side = shellSide(in);
  const double out = side == levelset::ShellSide::In ? 0 : in.length("thickness");
  plan.bounds.min -= Imath::V3d(out);
  plan.bounds.max += Imath::V3d(out);
  plan.area *= 2;
  return plan;
}

Value keep(Invocation& in) {
  const auto count = static_cast<std::size_t>(in.integer("largest"));
  return Value(levelset::keepLargest(in.band(), count, in.progress));
}

Value fillCavities(Invocation& in) {
  const double most = in.given("up-to") ? in.number("up-to") : levelset::kAnyVolume;
  return Value(levelset::fillCavities(in.band(), most, in.progress));
}

template <CsgOperation operation>
Operator csgOperator(const char* name, const char* summary, const char* example) {
  return {.name = name,
          .group = "Solids",
          .summary = summary,
          .details =
              "Operands on different grids are brought to the finest of them, and the report says "
              "so. Without "
              "names it takes the two newest values, older first.",
          .example = example,
          .operands = {{Kind::Band}, {Kind::Band}},
          .takesMore = true,
          .run = csg<operation>,
          .plan = planCsg<operation>,
          .cost = costPerVoxel(90, 8),
          .slope = Slope::OfOperands,
          .regionOfInterest = roiOfCsg};
}

}  // namespace

void addSolidOperators(std::vector<Operator>& all) {
  all.push_back(csgOperator<CsgOperation::Union>(
      "union", "all that is in any of the solids",
      "levelsmith sphere --radius 2 --voxel 0.1 ! box --size 3,3,3 --voxel 0.1 ! union ! measure"));
  all.push_back(
      csgOperator<CsgOperation::Intersection>("intersection", "what is in all of the solids",
                                              "levelsmith sphere --radius 2 --voxel 0.1 ! box "
                                              "--size 3,3,3 --voxel 0.1 ! intersection ! measure"));
  all.push_back(
      csgOperator<CsgOperation::Difference>("difference", "the first solid without the others",
                                            "levelsmith box --size 3,3,3 --voxel 0.1 ! sphere "
                                            "--radius 1.8 --voxel 0.1 ! difference ! measure"));
  all.push_back({
      .name = "blend",
      .group = "Solids",
      .summary = "union, intersection or difference with a rounded seam",
      .details =
          "'curvature' flows along the curve in which the two surfaces meet; nothing changes "
          "further than the radius from it. 'fillet' is what a ball of that radius leaves "
          "that rolls along the seam: an arc of the radius, tangent to both surfaces, with "
          "nothing changed beyond radius / tan(angle / 2). Solids that are near but do not "
          "meet stay apart.",
      .example = "levelsmith box --size 8,8,2 --voxel 0.1 ! cylinder --radius 1.5 --height 6 "
                 "--voxel 0.1 ! blend --radius 0.8 ! measure",
      .params = {{.name = "radius",
                  .type = ParamType::Length,
                  .doc = "of the rounding",
                  .range = Range::NonNegative,
                  .required = true},
                 {.name = "op",
                  .type = ParamType::Choice,
                  .doc = "what is blended",
                  .fallback = "union",
                  .choices = {"union", "intersection", "difference"}},
                 {.name = "method",
                  .type = ParamType::Choice,
                  .doc = "how the seam is rounded",
                  .fallback = "curvature",
                  .choices = {"curvature", "fillet"}},
                 {.name = "reach",
                  .type = ParamType::Length,
                  .doc = "fillet: how far the middle of its arc may be from the seam, beyond which "
                         "the ball gets smaller; default: twice the radius",
                  .range = Range::Positive},
                 {.name = "side",
                  .type = ParamType::Choice,
                  .doc = "add material, remove it, or both",
                  .fallback = "both",
                  .choices = {"both", "add", "remove"}}},
      .operands = {{Kind::Band}, {Kind::Band}},
      .run = blend,
      .plan = planCsg<CsgOperation::Union>,
  });
  all.push_back({
      .name = "offset",
      .group = "Solids",
      .summary = "move the surface along its normal; positive grows the solid",
      .details = "Outwards, convex edges become round and concave ones stay sharp; inwards the "
                 "reverse. --by displaces each point of the surface by a length of its own, "
                 "--mask a part of it.",
      .example = "levelsmith sphere --radius 1 --voxel 0.05 ! offset 2vx ! measure",
      .params = withMask({{.name = "distance",
                           .type = ParamType::Length,
                           .doc = "how far; negative shrinks",
                           .position = 0},
                          {.name = "by",
                           .type = ParamType::Scalar,
                           .doc = "how far at each point of the surface, world units"},
                          {.name = "half-width",
                           .type = ParamType::Number,
                           .doc = "of the result, in voxels; default: as before",
                           .range = Range::Positive}}),
      .operands = {{Kind::Band}},
      .run = offset,
      .plan = planOffset,
      .cost = costOfMoving,
      .slope = Slope::One,
      .regionOfInterest = roiOfOffset,
      .partTolerance = kDistanceTolerance,
      .validate = validateOffset,
  });
  const Param halfWidth = {.name = "half-width",
                           .type = ParamType::Number,
                           .doc = "of the result, in voxels; default: as before",
                           .range = Range::Positive};
  const Param ball = {.name = "radius",
                      .type = ParamType::Length,
                      .doc = "of the ball",
                      .range = Range::NonNegative,
                      .required = true,
                      .position = 0};
  all.push_back({
      .name = "open",
      .group = "Solids",
      .summary = "all balls of a radius that fit into the solid: drops thin parts",
      .details =
          "Moves the surface inwards and back: parts thinner than twice the radius go, convex "
          "edges are rounded to it, the rest stays.",
      .example = "levelsmith box --size 2,2,2 --voxel 0.05 ! open 0.3 ! measure",
      .params = withMask({ball, halfWidth}),
      .operands = {{Kind::Band}},
      .run = open,
      .plan = planMorphology,
      .cost = costOfMorphology,
      .slope = Slope::OfOperands,
      .regionOfInterest = roiOfMorphology,
      .partTolerance = kDistanceTolerance,
  });
  all.push_back({
      .name = "close",
      .group = "Solids",
      .summary = "fill what no ball of a radius outside the solid gets into",
      .details = "Moves the surface outwards and back: gaps narrower than twice the radius are "
                 "filled, concave edges are rounded to it, the rest stays.",
      .example = "levelsmith box --size 2,2,0.6 --voxel 0.05 ! cylinder --radius 0.4 --height 2 "
                 "--voxel 0.05 ! union ! close 0.3 ! measure",
      .params = withMask({ball, halfWidth}),
      .operands = {{Kind::Band}},
      .run = close,
      .plan = planMorphology,
      .cost = costOfMorphology,
      .slope = Slope::OfOperands,
      .regionOfInterest = roiOfMorphology,
      .partTolerance = kDistanceTolerance,
  });
  all.push_back({
      .name = "shell",
      .group = "Solids",
      .summary = "hollow a solid: the wall along its surface",
      .example = "levelsmith sphere --radius 1 --voxel 0.05 ! shell --thickness 0.2 ! measure",
      .params =
          withMask({{.name = "thickness",
                     .type = ParamType::Length,
                     .doc = "of the wall, a voxel or more",
                     .range = Range::Positive,
                     .required = true},
                    {.name = "side",
                     .type = ParamType::Choice,
                     .doc = "where the wall lies: inside the surface, outside, or half and half",
                     .fallback = "in",
                     .choices = {"in", "out", "both"}},
                    halfWidth}),
      .operands = {{Kind::Band}},
      .run = shell,
      .plan = planShell,
      .cost = costOfShell,
      .slope = Slope::OfOperands,
      .regionOfInterest = roiOfShell,
      .partTolerance = kDistanceTolerance,
  });
  all.push_back({
      .name = "keep",
      .group = "Solids",
      .summary = "keep the largest solids and drop small parts",
      .example = "levelsmith sphere --radius 2 --voxel 0.1 ! sphere --radius 0.5 --center 4,0,0 "
                 "--voxel 0.1 ! union ! keep --largest 1 ! measure",
      .params = {{.name = "largest",
                  .type = ParamType::Integer,
                  .doc = "how many to keep, by volume",
                  .range = Range::Positive,
                  .required = true}},
      .operands = {{Kind::Band}},
      .run = keep,
      .cost = costPerVoxel(200, 22),
  });
  all.push_back({
      .name = "fill-cavities",
      .group = "Solids",
      .summary = "fill enclosed voids",
      .example = "levelsmith sphere --radius 2 --voxel 0.1 ! sphere --radius 1 --voxel 0.1 ! "
                 "difference ! fill-cavities ! measure",
      .params = {{.name = "up-to",
                  .type = ParamType::Number,
                  .doc = "only voids up to this volume, world units cubed",
                  .range = Range::Positive}},
      .operands = {{Kind::Band}},
      .run = fillCavities,
      .cost = costPerVoxel(200, 22),
  });
}

}  // namespace pipeline
