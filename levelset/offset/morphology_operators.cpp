#include "levelset/csg/csg.h"
#include "levelset/distance/redistance.h"
#include "levelset/morph/masked.h"
#include "levelset/offset/morphology.h"

namespace levelset {
namespace {

/// Applies `change`, an opening, a closing or a shell, to the solid; with a mask, only where the
/// mask allows it.
/// @param farthest  largest distance by which the change moves the surface, world units
template <class Options, class Change>
NarrowBand changed(const NarrowBand& solid, const Options& options, double farthest,
                   OperatorRun& run, const Change& change) {
  const auto apply = [&](const Progress& progress) {
    return change(solid, OffsetOptions{
                             .halfWidth = options.halfWidth,
                             .maxMemory = run.maxMemory,
                             .progress = progress,
                         });
  };
  if (!options.mask) return apply(run.progress);
  return masked(solid, *options.mask, farthest, apply,
                {
                    .halfWidth = options.halfWidth,
                    .maxMemory = run.maxMemory,
                    .progress = run.progress,
                });
}

}  // namespace

ValuePlan MorphologyOperator::plan(const Options& options, Plans operands, const OperatorRun&) {
  ValuePlan plan = operands[0];
  if (options.halfWidth) plan.halfWidth = *options.halfWidth;
  return plan;
}

/// Extends the region by the reach of both offsets, away and back.
RegionOfInterest MorphologyOperator::regionOfInterest(const Options& options,
                                                      const OperatorPlans& plans, std::size_t,
                                                      const RegionOfInterest& ofResult) {
  if (options.mask) return {};
  const ValuePlan& solid = plans.operands[0];
  const double radius = options.radius / solid.voxelSize,
               away = offsetReach(radius, solid.halfWidth),
               back = offsetReach(radius, plans.result.halfWidth);
  const double reach = (away + back) * solid.voxelSize;
  return {.region = grown(ofResult.region, reach)};
}

std::optional<Cost> MorphologyOperator::cost(const Options& options, const OperatorPlans& plans) {
  if (options.mask) return {};
  const ValuePlan& solid = plans.operands[0];
  const double layer = solid.layer(), distance = options.radius / solid.voxelSize;
  Cost cost = costOfOffset(layer, layer, distance, solid.halfWidth);
  cost += costOfOffset(layer, layer, distance, plans.result.halfWidth);
  cost.bytes += kBytesPerVoxel * solid.activeVoxels();  // band of the solid after the first offset
  return cost;
}

const OperatorText OpenOperator::text{
    .name = "open",
    .group = "Solids",
    .summary = "keep all balls of a given radius that fit into the solid; removes thin parts",
    .details =
        "Moves the surface inwards and back. Parts thinner than twice the radius disappear, convex "
        "edges are rounded to the radius, and the rest stays.",
    .example = "levelsmith box --size 2,2,2 --voxel 0.05 ! open 0.3 ! measure"};

NarrowBand OpenOperator::run(std::vector<NarrowBand> operands, const Options& options,
                             OperatorRun& run) {
  return changed(operands[0], options, options.radius, run,
                 [&](const NarrowBand& solid, const OffsetOptions& settings) {
                   return opening(solid, options.radius, settings);
                 });
}

const OperatorText CloseOperator::text{
    .name = "close",
    .group = "Solids",
    .summary = "fill the space that no ball of a given radius outside the solid can enter",
    .details =
        "Moves the surface outwards and back. Gaps narrower than twice the radius are "
        "filled, concave edges are rounded to the radius, and the rest stays.",
    .example =
        "levelsmith box --size 2,2,0.6 --voxel 0.05 ! cylinder --radius 0.4 --height 2 "
        "--voxel 0.05 ! union ! close 0.3 ! measure"};

NarrowBand CloseOperator::run(std::vector<NarrowBand> operands, const Options& options,
                              OperatorRun& run) {
  return changed(operands[0], options, options.radius, run,
                 [&](const NarrowBand& solid, const OffsetOptions& settings) {
                   return closing(solid, options.radius, settings);
                 });
}

const OperatorText ShellOperator::text{
    .name = "shell",
    .group = "Solids",
    .summary = "hollow a solid: keep a wall along its surface",
    .example = "levelsmith sphere --radius 1 --voxel 0.05 ! shell --thickness 0.2 ! measure"};

NarrowBand ShellOperator::run(std::vector<NarrowBand> operands, const Options& options,
                              OperatorRun& run) {
  return changed(operands[0], options, options.thickness, run,
                 [&](const NarrowBand& solid, const OffsetOptions& settings) {
                   return shell(solid, options.thickness, options.side, settings);
                 });
}

ValuePlan ShellOperator::plan(const Options& options, Plans operands, const OperatorRun&) {
  ValuePlan plan = operands[0];
  if (options.halfWidth) plan.halfWidth = *options.halfWidth;
  plan.bounds = grown(plan.bounds, options.side == ShellSide::In ? 0 : options.thickness);
  plan.area *= 2;
  return plan;
}

RegionOfInterest ShellOperator::regionOfInterest(const Options& options, const OperatorPlans& plans,
                                                 std::size_t, const RegionOfInterest& ofResult) {
  if (options.mask) return {};
  const double width = plans.result.halfWidth, voxel = plans.operands[0].voxelSize;
  const double reach = (offsetReach(options.thickness / voxel, width) + seamReach(width)) * voxel;
  return {.region = grown(ofResult.region, reach)};
}

std::optional<Cost> ShellOperator::cost(const Options& options, const OperatorPlans& plans) {
  if (options.mask) return {};
  const ValuePlan& solid = plans.operands[0];
  const double layer = solid.layer(), distance = options.thickness / solid.voxelSize;
  const double width = plans.result.halfWidth;
  if (options.side != ShellSide::Both) return costOfOffset(layer, layer, distance, width);
  Cost cost = costOfOffset(layer, layer, distance / 2, width);
  return cost += costOfOffset(layer, layer, distance / 2, width);
}

}  // namespace levelset
