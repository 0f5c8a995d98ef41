#include <cmath>

#include "levelset/distance/redistance.h"
#include "levelset/distance/sweep_width.h"
#include "levelset/error.h"
#include "levelset/offset/offset.h"

namespace levelset {

Cost costOfOffset(double before, double after, double distance, double halfWidth) {
  const bool isOnePass = followsFromOld(distance, halfWidth);
  constexpr double kShell = 3;  // voxels: half width of the first of two distance transforms
  Cost cost = costOfDistances(std::max(before, after), isOnePass ? halfWidth : kShell);
  cost.seconds += 1e-9 * before * 700 * std::abs(distance);
  cost.bytes += 15 * before * std::abs(distance);
  Cost second = costOfDistances(after, halfWidth);
  if (isOnePass) second.seconds *= 0.4;  // correction beside creases, as measured on a scan
  return cost += second;
}

const OperatorText OffsetOperator::text{
    .name = "offset",
    .group = "Solids",
    .summary = "move the surface along its normal; positive grows the solid",
    .details =
        "Outwards, convex edges become round and concave ones stay sharp; inwards the reverse. "
        "--by moves each point of the surface by a distance of its own, --mask limits the offset "
        "to a part of the surface.",
    .example = "levelsmith sphere --radius 1 --voxel 0.05 ! offset 2vx ! measure"};

void OffsetOperator::check(const Options&, const GivenOptions& given) {
  if (given("distance") == given("by"))
    throw UsageError(given("by") ? "a distance and --by exclude each other; leave one out"
                                 : "the distance is missing; give a length, or --by and a field");
}

NarrowBand OffsetOperator::run(std::vector<NarrowBand> operands, const Options& options,
                               OperatorRun& run) {
  OffsetOptions settings{
      .halfWidth = options.halfWidth, .maxMemory = run.maxMemory, .progress = run.progress};
  // If the operand is narrowed to a region of interest, give the result the half width of the
  // complete result, so that the computed part has the bits of the complete result. The distance
  // over which closest points propagate affects the last bits.
  if (run.isPartial) settings.halfWidth = run.planned->halfWidth;
  NarrowBand solid = std::move(operands[0]);
  operands.clear();
  if (!options.mask && !options.by) return offset(std::move(solid), *options.distance, settings);
  ScalarField distance = options.by;
  if (!distance)
    distance = [everywhere = *options.distance](const Imath::V3d&) { return everywhere; };
  if (options.mask)
    distance = [distance, mask = *options.mask](const Imath::V3d& p) {
      return mask.weight(p) * distance(p);
    };
  return offsetBy(std::move(solid), distance, settings);
}

ValuePlan OffsetOperator::plan(const Options& options, Plans operands, const OperatorRun&) {
  ValuePlan plan = operands[0];
  if (options.halfWidth) plan.halfWidth = *options.halfWidth;
  if (!options.distance) return plan;  // the field of --by is not evaluated before the run
  const double before = plan.bounds.size().length();
  plan.bounds = grown(plan.bounds, *options.distance);
  const double after = plan.bounds.isEmpty() ? 0 : plan.bounds.size().length();
  if (before > 0) plan.area *= (after / before) * (after / before);
  return plan;
}

RegionOfInterest OffsetOperator::regionOfInterest(const Options& options,
                                                  const OperatorPlans& plans, std::size_t,
                                                  const RegionOfInterest& ofResult) {
  if (!options.distance || options.mask || *options.distance == 0) return {};
  const double voxel = plans.operands[0].voxelSize;
  const double reach = offsetReach(*options.distance / voxel, plans.result.halfWidth) * voxel;
  return {.halfWidth = kReadBySurface, .region = grown(ofResult.region, reach)};
}

std::optional<Cost> OffsetOperator::cost(const Options& options, const OperatorPlans& plans) {
  const ValuePlan& solid = plans.operands[0];
  const double distance = options.distance ? *options.distance / solid.voxelSize : 0;
  const double before = solid.layer();
  Cost cost = costOfOffset(before, plans.result.layer(), distance, plans.result.halfWidth);
  const double extent = plans.result.bounds.size().x / plans.result.voxelSize;
  if (extent > kSweepWidth) cost.bytes *= kSweepWidth / extent;
  // Triangles near edges, and grid points to be measured at the end, are held for the whole grid.
  cost.bytes += 100 * before;
  // A variable distance is first evaluated at the points of the surface, which takes a further
  // distance transform.
  if (options.by || options.mask) {
    cost += costOfDistances(before, 12);
    cost.bytes += 60 * solid.activeVoxels();
  }
  return cost;
}

}  // namespace levelset
