#include <fmt/core.h>

#include <cmath>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/operators/level_set_operator.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/csg/clip.h"
#include "levelset/error.h"
#include "levelset/points/processing/normals.h"
#include "levelset/points/processing/outliers.h"
#include "levelset/points/processing/place_points.h"
#include "levelset/points/processing/point_neighbours.h"
#include "levelset/points/processing/sample_mesh.h"
#include "levelset/points/processing/thin.h"
#include "levelset/transform/transform.h"

namespace pipeline {
namespace {

using levelset::PointCloud;
using levelset::UsageError;

Kind makesPoints(const Invocation&) {
  return Kind::Points;
}

bool isCloudOperand(const Invocation& in) {
  return !in.operands.empty() && in.operands[0].kind() == Kind::Points;
}

/// Cost for each point of the operand.
CostOf costPerPoint(double nanoseconds, double bytes) {
  return [=](Invocation& in) -> std::optional<Cost> {
    const double points = in.operands[0].plan().points;
    if (!(points > 0)) return std::nullopt;
    return Cost{1e-9 * nanoseconds * points, bytes * points};
  };
}

/// Requires exactly one of two options.
void requireOneOf(const Invocation& in, const char* first, const char* second) {
  if (in.given(first) == in.given(second))
    throw UsageError(fmt::format("{}: give either --{} or --{}", in.op().name, first, second));
}

// === Sampling of meshes

Value samplePoints(Invocation& in) {
  levelset::SampleOptions options{.isBlueNoise = in.text("method") == "blue-noise",
                                  .noise = in.length("noise"),
                                  .hasNormals = !in.flag("no-normals"),
                                  .seed = in.integerAs<std::uint64_t>("seed"),
                                  .maxMemory = in.maxMemory,
                                  .progress = in.progress};
  if (in.given("count")) options.count = in.integerAs<std::size_t>("count");
  if (in.given("spacing")) options.spacing = in.length("spacing");
  return Value(levelset::sampleMesh(in.mesh(), options));
}

Plan planSample(Invocation& in) {
  Plan plan = in.operands[0].plan();
  plan.kind = Kind::Points;
  const double spacing = in.given("spacing") ? in.length("spacing") : 0;
  plan.points = in.given("count") ? static_cast<double>(in.integer("count"))
                                  : plan.area / (std::sqrt(3.0) / 2 * spacing * spacing);
  // The area is an estimate, so only far too many points are refused here.
  constexpr double kFarTooMany = 4e9;
  if (!(plan.points < kFarTooMany))
    throw levelset::ResourceLimit(
        fmt::format("the surface would take about {:.3g} points, more than 8e8; give a smaller "
                    "count or a larger spacing",
                    plan.points));
  plan.pointBytes = sizeof(Imath::V3d) + (in.flag("no-normals") ? 0 : sizeof(Imath::V3f));
  return plan;
}

std::optional<Cost> costOfSample(Invocation& in) {
  if (!in.planned) return std::nullopt;
  const bool isBlue = in.text("method") == "blue-noise";
  const double points = in.planned->points;
  return Cost{(isBlue ? 2e-5 : 2e-7) * points, (isBlue ? 650.0 : 0.0) * points};
}

// === Thinning, outliers, normals

Value thinPoints(Invocation& in) {
  levelset::ThinOptions options{.maxMemory = in.maxMemory, .progress = in.progress};
  if (in.given("radius")) options.radius = in.length("radius");
  if (in.given("count")) options.count = in.integerAs<std::size_t>("count");
  const PointCloud& cloud = in.operands[0].cloud();
  PointCloud thinned = levelset::thin(cloud, options);
  in.notes.detailsJson = Json{{"points_before", cloud.size()}, {"points", thinned.size()}}.dump();
  in.notes.notes.push_back(fmt::format("thin: kept {} of {} points", thinned.size(), cloud.size()));
  return Value(std::move(thinned));
}

Value removeOutliers(Invocation& in) {
  levelset::OutlierResult result = levelset::withoutOutliers(
      in.operands[0].cloud(), {.neighbours = in.integerAs<int>("neighbours"),
                               .deviations = in.number("deviations"),
                               .maxMemory = in.maxMemory,
                               .progress = in.progress});
  in.notes.detailsJson = Json{{"removed", result.removed}, {"limit", result.limit}}.dump();
  in.notes.notes.push_back(fmt::format("outliers: removed {} of {} points", result.removed,
                                       result.removed + result.cloud.size()));
  return Value(std::move(result.cloud));
}

Value computeNormals(Invocation& in) {
  const std::string degree = in.text("degree");
  const bool isOriented = !in.flag("no-orient");
  levelset::NormalsResult result = levelset::estimateNormals(
      in.operands[0].cloud(), {.neighbours = in.integerAs<int>("neighbours"),
                               .degree = degree == "1"   ? levelset::FitDegree::One
                                         : degree == "2" ? levelset::FitDegree::Two
                                                         : levelset::FitDegree::Adaptive,
                               .isOriented = isOriented,
                               .maxMemory = in.maxMemory,
                               .progress = in.progress});
  const levelset::NormalsReport& found = result.report;
  Json json{{"missing", found.missing}, {"quadratic", found.quadratic}};
  if (isOriented) {
    json["parts"] = found.components;
    json["guessed_parts"] = found.guessed;
    json["doubtful_share"] = found.doubtful;
  }
  in.notes.detailsJson = json.dump();
  if (found.missing > 0)
    in.notes.warnings.push_back(
        fmt::format("normals: {} points have no normal, since their neighbours lie on a line; "
                    "raise --neighbours",
                    found.missing));
  if (found.guessed > 0)
    in.notes.warnings.push_back(fmt::format(
        "normals: the outside of {} of {} connected parts is a guess, since they enclose nothing; "
        "turn them with 'transform' or read normals with the file",
        found.guessed, found.components));
  constexpr double kMostDoubtful = 0.1;
  if (found.doubtful > kMostDoubtful)
    in.notes.warnings.push_back(fmt::format(
        "normals: at {:.0f} % of the tested points{}, the winding number does not confirm "
        "the outside; the surface is open there, or its normals are inconsistent",
        100 * found.doubtful, found.guessed > 0 ? " of the other parts" : ""));
  return Value(std::move(result.cloud));
}

Plan planNormals(Invocation& in) {
  Plan plan = in.operands[0].plan();
  plan.pointBytes = std::max(plan.pointBytes, 1.0 * sizeof(Imath::V3d) + sizeof(Imath::V3f));
  return plan;
}

Param neighboursParam(const char* doc, const char* fallback) {
  return {.name = "neighbours",
          .type = ParamType::Integer,
          .doc = doc,
          .fallback = fallback,
          .range = Range::Positive};
}

void requireFewNeighbours(const Invocation& in) {
  levelset::withContext(in.op().name,
                        [&] { levelset::points::requireNeighbours(in.integer("neighbours")); });
}

}  // namespace

Operator sampleOperator() {
  return {
      .name = "sample",
      .group = "Points",
      .summary = "place points on the surface of a mesh, with the normals of its triangles",
      .details =
          "With blue-noise, the points have similar distances to their neighbours. With uniform, "
          "they are independent. --noise moves each coordinate by a normally distributed amount; "
          "the normals stay those of the surface. Equal options give equal points.",
      .example = "levelsmith sphere --radius 1 --voxel 0.05 ! mesh ! sample --count 2000 ! info",
      .params = {{.name = "count",
                  .type = ParamType::Integer,
                  .doc = "number of points",
                  .range = Range::Positive},
                 {.name = "spacing",
                  .type = ParamType::Length,
                  .doc = "distance between neighbours, in place of --count; it is exact for a "
                         "hexagonal lattice",
                  .range = Range::Positive,
                  .allowsVoxels = false},
                 {.name = "method",
                  .type = ParamType::Choice,
                  .doc = "distribution of the points",
                  .fallback = "blue-noise",
                  .choices = {"blue-noise", "uniform"}},
                 {.name = "noise",
                  .type = ParamType::Length,
                  .doc = "standard deviation of the noise in each coordinate",
                  .fallback = "0",
                  .range = Range::NonNegative,
                  .allowsVoxels = false},
                 {.name = "seed",
                  .type = ParamType::Integer,
                  .doc = "number that selects one of many sets of points",
                  .fallback = "1",
                  .range = Range::NonNegative},
                 {.name = "no-normals",
                  .type = ParamType::Flag,
                  .doc = "leave out the normals of the points"}},
      .operands = {{Kind::Mesh}},
      .resultKind = makesPoints,
      .run = samplePoints,
      .plan = planSample,
      .cost = costOfSample,
      .validate = [](const Invocation& in) { requireOneOf(in, "count", "spacing"); },
  };
}

Operator normalsOperator() {
  return {
      .name = "normals",
      .group = "Points",
      .summary = "compute the normals of a point cloud, and turn them outwards",
      .details =
          "A height function is fitted to the neighbours of each point by least squares, of degree "
          "1 or 2. Beside a sharp edge, only the points on one side of it are fitted. The normals "
          "are made consistent along a minimum spanning tree. Then each connected part is turned "
          "outwards by its winding number; a part inside another one is a cavity. Present normals "
          "are replaced.",
      .example = "levelsmith sphere --radius 1 --voxel 0.05 ! mesh ! sample --count 2000 ! normals",
      .params = {neighboursParam("number of nearest points that are fitted, from 3 to 1000", "20"),
                 {.name = "degree",
                  .type = ParamType::Choice,
                  .doc = "degree of the height function; auto: for each point, the one with the "
                         "smaller error of prediction",
                  .fallback = "auto",
                  .choices = {"auto", "1", "2"}},
                 {.name = "no-orient",
                  .type = ParamType::Flag,
                  .doc = "leave the sign of each normal arbitrary"}},
      .operands = {{Kind::Points}},
      .resultKind = makesPoints,
      .run = computeNormals,
      .plan = planNormals,
      .cost = costPerPoint(20000, 160),
      .validate =
          [](const Invocation& in) {
            if (in.integer("neighbours") < 3)
              throw UsageError(
                  "normals: fewer than 3 --neighbours determine no plane; give at least 3");
            requireFewNeighbours(in);
          },
  };
}

Operator outliersOperator() {
  return {
      .name = "outliers",
      .group = "Points",
      .summary = "remove points that lie far from all others",
      .details =
          "A point is removed if its mean distance to its nearest neighbours exceeds the median of "
          "all points by --deviations standard deviations. The standard deviation is estimated by "
          "the median of the deviations, so that the outliers do not change it. It is at least a "
          "tenth of the median.",
      .example =
          "levelsmith sphere --radius 1 --voxel 0.05 ! mesh ! sample --count 2000 ! outliers ! "
          "info",
      .params = {neighboursParam("number of nearest points that decide on a point, at most 1000",
                                 "16"),
                 {.name = "deviations",
                  .type = ParamType::Number,
                  .doc = "number of standard deviations above the median",
                  .fallback = "6",
                  .range = Range::Positive}},
      .operands = {{Kind::Points}},
      .resultKind = makesPoints,
      .run = removeOutliers,
      .cost = costPerPoint(6000, 60),
      .validate = requireFewNeighbours,
  };
}

Operator thinOperator() {
  return {
      .name = "thin",
      .group = "Points",
      .summary = "keep a part of the points that is spread evenly (blue noise)",
      .details =
          "With --radius, no two points of the result are nearer than the radius, and each removed "
          "point is nearer than the radius to a kept one. With --count, points are removed one "
          "after another, each time the one with the most crowded neighbourhood.",
      .example =
          "levelsmith sphere --radius 1 --voxel 0.05 ! mesh ! sample --count 20000 --method "
          "uniform "
          "! thin --radius 0.05 ! info",
      .params = {{.name = "radius",
                  .type = ParamType::Length,
                  .doc = "least distance between two points of the result",
                  .range = Range::Positive,
                  .allowsVoxels = false},
                 {.name = "count",
                  .type = ParamType::Integer,
                  .doc = "number of points of the result, in place of --radius",
                  .range = Range::Positive}},
      .operands = {{Kind::Points}},
      .resultKind = makesPoints,
      .run = thinPoints,
      .cost = costPerPoint(3000, 150),
      .validate = [](const Invocation& in) { requireOneOf(in, "radius", "count"); },
  };
}

Operator transformOperator() {
  using Transform = levelset::TransformOperator;
  const Operator ofSolids = levelSetOperator<Transform>();
  Operator op = ofSolids;
  op.summary = "move, turn, scale or mirror a solid, a mesh or a point cloud";
  op.operands = {{Kind::Band, Kind::Mesh, Kind::Points}};
  op.run = [ofSolids](Invocation& in) {
    if (!isCloudOperand(in)) return ofSolids.run(in);
    const auto options = readOptions<Transform::Options>(in, OptionStage::Run);
    return Value(levelset::transform(in.operands[0].cloud(), Transform::matrixOf(options)));
  };
  op.cost = [ofSolids](Invocation& in) -> std::optional<Cost> {
    if (isCloudOperand(in)) return costPerPoint(20, 0)(in);
    return ofSolids.cost(in);
  };
  op.validate = [ofSolids](const Invocation& in) {
    if (!isCloudOperand(in)) return ofSolids.validate(in);
    if (in.given("bake") || in.given("voxel"))
      throw UsageError(
          "transform: --bake and --voxel are for level sets, but the operand is a point cloud; "
          "leave them out");
    Invocation probe = in;
    Transform::check(readOptions<Transform::Options>(probe, OptionStage::Syntax),
                     {[&in](std::string_view name) { return in.given(std::string(name)); }, true});
  };
  return op;
}

Operator clipOperator() {
  using Clip = levelset::ClipOperator;
  const Operator ofSolids = levelSetOperator<Clip>();
  Operator op = ofSolids;
  op.summary = "cut a solid by a box or a plane and close the cut, or keep a part of the points";
  op.operands = {{Kind::Band, Kind::Points}};
  op.resultKind = [](const Invocation& in) {
    return isCloudOperand(in) ? Kind::Points : Kind::Band;
  };
  op.run = [ofSolids](Invocation& in) {
    if (!isCloudOperand(in)) return ofSolids.run(in);
    const auto options = readOptions<Clip::Options>(in, OptionStage::Run);
    const PointCloud& cloud = in.operands[0].cloud();
    if (options.box) return Value(levelset::clip(cloud, *options.box));
    return Value(
        levelset::clip(cloud, Imath::Plane3d(options.plane[0], options.plane[1].normalized())));
  };
  op.plan = [ofSolids](Invocation& in) {
    return isCloudOperand(in) ? in.operands[0].plan() : ofSolids.plan(in);
  };
  op.cost = [ofSolids](Invocation& in) -> std::optional<Cost> {
    if (isCloudOperand(in)) return costPerPoint(20, 0)(in);
    return ofSolids.cost(in);
  };
  return op;
}

}  // namespace pipeline
