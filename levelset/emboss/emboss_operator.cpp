#include <fmt/core.h>

#include <algorithm>
#include <numbers>

#include "levelset/distance/redistance.h"
#include "levelset/emboss/emboss.h"
#include "levelset/error.h"

namespace levelset {
namespace {

EmbossCurveShape shapeOf(const EmbossOperator::Options& options) {
  const bool isCurve = !options.curve.empty();
  return {.points = isCurve ? options.curve : options.points,
          .isJoined = isCurve,
          .isClosed = options.closed,
          .isSpline = options.smoothCurve};
}

/// Area of the surface within the width of the curve, if the curve lies on a plane.
double areaNear(const EmbossOperator::Options& options, const ValuePlan& solid) {
  const EmbossCurveShape shape = shapeOf(options);
  double area = std::numbers::pi * options.width * options.width;
  if (!shape.isJoined) area *= static_cast<double>(shape.points.size());
  for (std::size_t i = 0; shape.isJoined && i + 1 < shape.points.size(); ++i)
    area += 2 * options.width * (shape.points[i + 1] - shape.points[i]).length();
  return std::min(area, solid.area);
}

}  // namespace

const OperatorText EmbossOperator::text{
    .name = "emboss",
    .group = "Solids",
    .summary = "let the surface rise or sink along a curve or at points",
    .details =
        "Each point of the surface moves along its normal by a height that depends on its distance "
        "from the curve in space. With u = distance / width the height is that of --height times "
        "√(1 − u²) (round), 1 (flat), 1 − u (sharp) or (1 − u²)³ (smooth). A thin wall rises on "
        "both sides if both are within the width. Values farther from the curve than width + "
        "height + half width do not change.",
    .example =
        "levelsmith box --size 4,4,1 --voxel 0.05 ! emboss --curve \"-1,-1,0.5 0,1,0.5 "
        "1,-1,0.5\" --height 0.2 --width 0.3 --profile round ! write emboss.vdb"};

void EmbossOperator::check(const Options& options, const GivenOptions& given) {
  if (given("curve") == given("points"))
    throw UsageError(given("curve") ? "--curve and --points exclude each other; leave one out"
                                    : "the curve is missing; give --curve or --points");
  if (given("points") && (options.closed || options.smoothCurve))
    throw UsageError(fmt::format("--{} needs --curve; --points are not joined",
                                 options.closed ? "closed" : "smooth-curve"));
  if (options.closed && options.curve.size() < 3)
    throw UsageError("--closed needs at least three points of the curve; give more points");
}

NarrowBand EmbossOperator::run(std::vector<NarrowBand> operands, const Options& options,
                               OperatorRun& run) {
  EmbossOptions settings{.profile = options.profile,
                         .halfWidth = options.halfWidth,
                         .maxMemory = run.maxMemory,
                         .progress = run.progress};
  if (run.isPartial) settings.halfWidth = run.planned->halfWidth;
  constexpr double kLeastWidth = 2;  // voxels
  const double voxel = operands[0].voxelSize();
  if (options.width < kLeastWidth * voxel)
    run.notes.push_back(fmt::format(
        "the width is {:.2g} voxels; the grid does not resolve the profile below {} voxels",
        options.width / voxel, kLeastWidth));
  return emboss(operands[0], shapeOf(options), options.width, options.height, settings);
}

ValuePlan EmbossOperator::plan(const Options& options, Plans operands, const OperatorRun&) {
  ValuePlan plan = operands[0];
  if (options.halfWidth) plan.halfWidth = *options.halfWidth;
  if (plan.bounds.isEmpty() || !(options.height > 0)) return plan;
  Imath::Box3d near;
  for (const Imath::V3d& p : shapeOf(options).points) near.extendBy(p);
  near = grown(near, options.width + options.height);
  const Imath::Box3d most = grown(plan.bounds, options.height);
  for (int axis = 0; axis < 3; ++axis) {
    near.min[axis] = std::max(near.min[axis], most.min[axis]);
    near.max[axis] = std::min(near.max[axis], most.max[axis]);
  }
  if (!near.isEmpty()) plan.bounds.extendBy(near);
  return plan;
}

/// Grid points beyond the reach of the curve keep the bits of the operand, so the operand's
/// complete half width is needed.
RegionOfInterest EmbossOperator::regionOfInterest(const Options& options,
                                                  const OperatorPlans& plans, std::size_t,
                                                  const RegionOfInterest& ofResult) {
  const double halfWidth = std::max(plans.operands[0].halfWidth, plans.result.halfWidth);
  const double reach =
      std::abs(options.height) + 2 * distanceReach(halfWidth) * plans.operands[0].voxelSize;
  return {.region = grown(ofResult.region, reach)};
}

std::optional<Cost> EmbossOperator::cost(const Options& options, const OperatorPlans& plans) {
  const ValuePlan& solid = plans.operands[0];
  if (!(solid.area > 0)) return std::nullopt;
  const double share = areaNear(options, solid) / solid.area;
  const double layer = solid.layer() * share;
  Cost cost = costOfDistances(layer, std::abs(options.height) / solid.voxelSize + solid.halfWidth);
  cost += costOfDistances(layer, plans.result.halfWidth);
  cost.bytes += kBytesPerVoxel * solid.activeVoxels();
  return cost;
}

}  // namespace levelset
