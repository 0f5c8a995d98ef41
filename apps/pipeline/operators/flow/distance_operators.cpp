#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "apps/pipeline/graph/regions_of_interest.h"
#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/fields.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/distance/closest_points.h"
#include "levelset/distance/redistance.h"
#include "levelset/eikonal/arrival.h"
#include "levelset/error.h"

namespace pipeline {
namespace {

using levelset::FrontMethod;
using levelset::NarrowBand;

Value redistanceTo(Invocation& in, std::optional<double> halfWidth) {
  levelset::RedistanceOptions options{.maxMemory = in.maxMemory, .progress = in.progress};
  options.halfWidth = halfWidth;
  if (in.isPartial) options.halfWidth = in.planned->halfWidth;
  NarrowBand band = in.band();
  in.operands.clear();
  return Value(levelset::redistance(std::move(band), options));
}

Value reinitialize(Invocation& in) {
  return redistanceTo(
      in, in.given("half-width") ? std::optional(in.number("half-width")) : std::nullopt);
}

Value widen(Invocation& in) {
  return redistanceTo(in, in.number("half-width"));
}

/// What is a distance already is kept, so it is read as wide as it is asked for.
RegionOfInterest roiOfRedistance(Invocation& in, std::size_t, const RegionOfInterest& of) {
  const double voxel = in.operands[0].plan().voxelSize;
  return {.halfWidth = std::max(levelset::kReadBySurface, of.halfWidth + 1),
          .region = grown(of.region, levelset::distanceReach(in.planned->halfWidth) * voxel)};
}

std::optional<Cost> costOfRedistance(Invocation& in) {
  return costOfDistances(layerOf(in.operands[0].plan()), in.planned->halfWidth);
}

Plan planHalfWidth(Invocation& in) {
  Plan plan = in.operands[0].plan();
  if (in.given("half-width")) plan.halfWidth = in.number("half-width");
  return plan;
}

Plan planField(Invocation& in, double halfWidth, double bytesPerVoxel) {
  Plan plan = in.operands[0].plan();
  plan.kind = Kind::Field;
  plan.halfWidth = halfWidth;
  plan.fieldBytes = plan.activeVoxels() * bytesPerVoxel;
  return plan;
}

Value closestPoint(Invocation& in) {
  levelset::ClosestPointOptions options{.maxMemory = in.maxMemory, .progress = in.progress};
  if (in.given("half-width")) options.halfWidth = in.number("half-width");
  return Value(levelset::closestPoints(in.band(), options));
}

Plan planClosestPoint(Invocation& in) {
  const Plan plan = planHalfWidth(in);
  return planField(in, plan.halfWidth, 16);
}

std::optional<Cost> costOfClosestPoints(Invocation& in) {
  const Plan solid = planHalfWidth(in);
  Cost cost = costOfDistances(layerOf(solid), solid.halfWidth);
  cost.bytes += planClosestPoint(in).fieldBytes;
  return cost;
}

bool givesField(const Invocation& in) {
  return in.given("speed") || in.given("from") || in.given("extend");
}

void tellFigures(Invocation& in, const levelset::ArrivalFigures& figures) {
  in.notes.notes.push_back(fmt::format("{} grid points reached", figures.reached));
  if (in.integer("order") == 2)
    in.notes.notes.push_back(
        fmt::format("{} of them fell back to first order on some axis", figures.firstOrder));
  in.notes.detailsJson = fmt::format(R"({{"reached":{},"started":{},"first_order":{}}})",
                                     figures.reached, figures.started, figures.firstOrder);
}

void validateFront(const Invocation& in) {
  for (const char* other : {"speed", "from", "order"})
    if (in.given("extend") && in.given(other))
      throw levelset::UsageError(
          fmt::format("{}: --extend carries an attribute along the normals, so --{} has no meaning "
                      "beside it; leave one out",
                      in.op().name, other));
}

/// The attribute of --extend, refused where the surface has none: the field made of it would not
/// know any more what was written, nor where.
levelset::ScalarField attributeOf(const Invocation& in) {
  return [attribute = scalarField(in, "extend"), where = in.where("extend"),
          text = in.text("extend")](const Imath::V3d& p) {
    const double value = attribute(p);
    if (std::isfinite(static_cast<float>(value))) return value;
    throw levelset::InvalidInput(
        fmt::format("{}: '{}' is {} on the surface at {:.6g},{:.6g},{:.6g}; give an attribute that "
                    "is finite on all of it",
                    where, text, value, p.x, p.y, p.z));
  };
}

Value extend(Invocation& in, double reach) {
  levelset::ClosestPointOptions options{.maxMemory = in.maxMemory, .progress = in.progress};
  options.halfWidth = reach / in.band().voxelSize();
  in.notes.notes.push_back("the attribute is that of the closest point of the surface");
  const auto named = in.named.find("extend");
  if (named != in.named.end() && named->second.kind() == Kind::Field &&
      named->second.field().isVector())
    return Value(levelset::extendOffSurface(in.band(), vectorField(in, "extend"), options));
  return Value(levelset::extendOffSurface(in.band(), attributeOf(in), options));
}

template <FrontMethod method>
Value runFront(Invocation& in) {
  const double reach = in.length("to");
  if (in.given("extend")) return extend(in, reach);
  levelset::ArrivalOptions options{.method = method};
  options.order = static_cast<int>(in.integer("order"));
  options.maxMemory = in.maxMemory;
  options.progress = in.progress;
  if (in.given("speed")) options.speed = scalarField(in, "speed");
  if (givesField(in)) {
    const levelset::ArrivalTimes result =
        in.given("from")
            ? levelset::arrivalTimesFromPoints(in.band(), in.points("from"), reach, options)
            : levelset::arrivalTimes(in.band(), reach, options);
    tellFigures(in, result.figures);
    return Value(result.times);
  }
  levelset::FrontDistance result = levelset::frontDistance(in.band(), reach, options);
  tellFigures(in, result.figures);
  return Value(std::move(result.band));
}

Plan planFront(Invocation& in) {
  const double reach = in.length("to");
  const double halfWidth = reach / in.operands[0].plan().voxelSize;
  if (givesField(in)) return planField(in, halfWidth, 8);
  Plan plan = in.operands[0].plan();
  plan.halfWidth = halfWidth;
  return plan;
}

template <FrontMethod method>
std::optional<Cost> costOfFront(Invocation& in) {
  const Plan solid = in.operands[0].plan();
  const double reach = in.length("to") / solid.voxelSize, voxels = layerOf(solid) * 2 * reach;
  if (in.given("from")) return {};  // by how much there is about the points
  if (in.given("extend")) return costOfDistances(layerOf(solid), reach);
  return Cost{1e-9 * (method == FrontMethod::Marching ? 1400 : 550) * voxels, 12 * voxels};
}

template <FrontMethod method>
Operator frontOperator(const char* name, const char* summary, const char* example) {
  return {
      .name = name,
      .group = "Distances",
      .summary = summary,
      .details =
          "Solves |grad T| F = 1 from the surface to both sides (negative inside) or from "
          "points. "
          "Without --speed, --from and --extend the times are distances and the result is a band "
          "again; `widen` makes the same by closest points, which is more exact. Otherwise the "
          "result is a field. Where the speed is zero, negative or no number, nothing passes.",
      .example = example,
      .params = {{.name = "to",
                  .type = ParamType::Length,
                  .doc = "how far: the latest time, which at speed 1 is a distance",
                  .fallback = "8vx",
                  .range = Range::Positive},
                 {.name = "speed",
                  .type = ParamType::Scalar,
                  .doc = "F, in world units per unit of time; default: 1"},
                 {.name = "from",
                  .type = ParamType::Points,
                  .doc = "start at these points, on the grid of the operand, in place of its "
                         "surface"},
                 {.name = "order",
                  .type = ParamType::Choice,
                  .doc = "of the differences; 2 falls back to 1 where it must",
                  .fallback = "2",
                  .choices = {"1", "2"}},
                 {.name = "extend",
                  .type = ParamType::Scalar,
                  .doc = "in place of times: this attribute, carried off the surface along its "
                         "normals"}},
      .operands = {{Kind::Band}},
      .resultKind = [](const Invocation& in) { return givesField(in) ? Kind::Field : Kind::Band; },
      .run = runFront<method>,
      .plan = planFront,
      .cost = costOfFront<method>,
      .validate = validateFront,
  };
}

Param halfWidthTo(bool required) {
  return {
      .name = "half-width",
      .type = ParamType::Number,
      .doc = required ? "of the result, in voxels" : "of the result, in voxels; default: as before",
      .range = Range::Positive,
      .required = required};
}

}  // namespace

void addEikonalOperators(std::vector<Operator>& all) {
  all.push_back({
      .name = "reinitialize",
      .group = "Distances",
      .summary = "make the values distances again without moving the surface",
      .details = "Only signs and the values beside the surface are read; they may have any slope.",
      .example = "levelsmith sphere --radius 1 --voxel 0.05 ! reinitialize --half-width 4 ! check",
      .params = {halfWidthTo(false)},
      .operands = {{Kind::Band}},
      .run = reinitialize,
      .plan = planHalfWidth,
      .cost = costOfRedistance,
      .slope = Slope::One,
      .regionOfInterest = roiOfRedistance,
      .partTolerance = kDistanceTolerance,
  });
  all.push_back({
      .name = "widen",
      .group = "Distances",
      .summary = "make the band wider or narrower; the surface stays",
      .details = "Distances by closest points: exact to interpolation at any width.",
      .example = "levelsmith sphere --radius 1 --voxel 0.05 ! widen --half-width 8 ! check",
      .params = {halfWidthTo(true)},
      .operands = {{Kind::Band}},
      .run = widen,
      .plan = planHalfWidth,
      .cost = costOfRedistance,
      .slope = Slope::One,
      .regionOfInterest = roiOfRedistance,
      .partTolerance = kDistanceTolerance,
  });
  all.push_back(frontOperator<FrontMethod::Marching>(
      "march", "arrival times and distances by fast marching",
      "levelsmith sphere --radius 1 --voxel 0.05 ! march --speed \"1 + 0.5*x\" --to 0.4 ! info"));
  all.push_back(frontOperator<FrontMethod::Sweeping>(
      "sweep", "arrival times and distances by fast sweeping",
      "levelsmith sphere --radius 1 --voxel 0.05 ! sweep --to 8vx ! check"));
  all.push_back({
      .name = "closest-point",
      .group = "Distances",
      .summary = "the closest point of the surface, for each grid point of the band",
      .details = "A field of vectors, in world units.",
      .example = "levelsmith sphere --radius 1 --voxel 0.05 ! closest-point --half-width 4 ! info",
      .params = {halfWidthTo(false)},
      .operands = {{Kind::Band}},
      .resultKind = [](const Invocation&) { return Kind::Field; },
      .run = closestPoint,
      .plan = planClosestPoint,
      .cost = costOfClosestPoints,
  });
}

}  // namespace pipeline
