#include <algorithm>

#include "levelset/distance/closest_points.h"
#include "levelset/distance/redistance.h"

namespace levelset {

template <bool isRequired>
NarrowBand RedistanceOperator<isRequired>::run(std::vector<NarrowBand> operands,
                                               const Options& options, OperatorRun& run) {
  RedistanceOptions settings{
      .halfWidth = options.halfWidth, .maxMemory = run.maxMemory, .progress = run.progress};
  if (run.isPartial) settings.halfWidth = run.planned->halfWidth;
  NarrowBand band = std::move(operands[0]);
  operands.clear();
  return redistance(std::move(band), settings);
}

template <bool isRequired>
ValuePlan RedistanceOperator<isRequired>::plan(const Options& options, Plans operands,
                                               const OperatorRun&) {
  ValuePlan plan = operands[0];
  if (options.halfWidth) plan.halfWidth = *options.halfWidth;
  return plan;
}

/// Redistancing keeps values that are distances already. So it reads the operand up to the half
/// width of the result, not only beside the surface.
template <bool isRequired>
RegionOfInterest RedistanceOperator<isRequired>::regionOfInterest(
    const Options&, const OperatorPlans& plans, std::size_t, const RegionOfInterest& ofResult) {
  const double voxel = plans.operands[0].voxelSize;
  return {.halfWidth = std::max(kReadBySurface, ofResult.halfWidth + 1),
          .region = grown(ofResult.region, distanceReach(plans.result.halfWidth) * voxel)};
}

template <bool isRequired>
std::optional<Cost> RedistanceOperator<isRequired>::cost(const Options&,
                                                         const OperatorPlans& plans) {
  return costOfDistances(plans.operands[0].layer(), plans.result.halfWidth);
}

template struct RedistanceOperator<false>;
template struct RedistanceOperator<true>;

const OperatorText RebuildBandOperator::text{
    .name = "rebuild-band",
    .group = "Distances",
    .summary = "make the band wider or narrower; the surface stays",
    .details =
        "Computes distances to closest points of the surface. The half width does not affect their "
        "accuracy.",
    .example = "levelsmith sphere --radius 1 --voxel 0.05 ! rebuild-band --half-width 8 ! check",
    .formerName = "widen"};

const OperatorText ClosestPointOperator::text{
    .name = "closest-point",
    .group = "Distances",
    .summary = "compute the closest point of the surface for each grid point of the band",
    .details = "The result is a field of vectors, in world units.",
    .example = "levelsmith sphere --radius 1 --voxel 0.05 ! closest-point --half-width 4 ! info"};

FieldGrid ClosestPointOperator::run(std::vector<NarrowBand> operands, const Options& options,
                                    OperatorRun& run) {
  return closestPoints(
      operands[0],
      {.halfWidth = options.halfWidth, .maxMemory = run.maxMemory, .progress = run.progress});
}

ValuePlan ClosestPointOperator::plan(const Options& options, Plans operands, const OperatorRun&) {
  constexpr double kBytes = 16;  // for each active voxel
  ValuePlan plan = operands[0];
  if (options.halfWidth) plan.halfWidth = *options.halfWidth;
  plan.fieldBytes = plan.activeVoxels() * kBytes;
  return plan;
}

std::optional<Cost> ClosestPointOperator::cost(const Options& options, const OperatorPlans& plans) {
  const ValuePlan solid = plan(options, plans.operands, {});
  Cost cost = costOfDistances(solid.layer(), solid.halfWidth);
  cost.bytes += solid.fieldBytes;
  return cost;
}

}  // namespace levelset
