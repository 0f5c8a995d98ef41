#include <fmt/core.h>

#include "levelset/error.h"
#include "levelset/hamilton_jacobi/normal_motion_vdb.h"
#include "levelset/hamilton_jacobi/pde_redistance.h"
#include "levelset/hamilton_jacobi/pde_steps.h"

namespace levelset {
namespace {

using ExactReinitialize = RedistanceOperator<false>;

ExactReinitialize::Options exactOptions(const ReinitializeOperator::Options& options) {
  return {.halfWidth = options.halfWidth};
}

}  // namespace

const OperatorText ReinitializeOperator::text{
    .name = "reinitialize",
    .group = "Distances",
    .summary = "compute distances again without moving the surface",
    .details =
        "Reads only the signs and the values beside the surface; these values may have any slope. "
        "--method pde solves the reinitialization equation, which moves the surface by a fraction "
        "of a voxel.",
    .example = "levelsmith sphere --radius 1 --voxel 0.05 ! reinitialize --half-width 4 ! check"};

void ReinitializeOperator::check(const Options& options, const GivenOptions& given) {
  for (const char* option : {"order", "time-order"})
    if (given(option) && options.method != RedistanceMethod::Pde)
      throw UsageError(fmt::format(
          "--{} applies only to the method pde; leave it out, or use --method pde", option));
  flow::requireOrders({options.order, options.timeOrder});
}

NarrowBand ReinitializeOperator::run(std::vector<NarrowBand> operands, const Options& options,
                                     OperatorRun& run) {
  if (options.method == RedistanceMethod::Exact)
    return ExactReinitialize::run(std::move(operands), exactOptions(options), run);
  return pdeRedistance(operands[0], {.halfWidth = options.halfWidth,
                                     .order = options.order,
                                     .timeOrder = options.timeOrder,
                                     .maxMemory = run.maxMemory,
                                     .progress = run.progress});
}

ValuePlan ReinitializeOperator::plan(const Options& options, Plans operands,
                                     const OperatorRun& run) {
  return ExactReinitialize::plan(exactOptions(options), operands, run);
}

/// The pde method has no part: its stencils reach across the band once in each step.
RegionOfInterest ReinitializeOperator::regionOfInterest(const Options& options,
                                                        const OperatorPlans& plans,
                                                        std::size_t operand,
                                                        const RegionOfInterest& ofResult) {
  if (options.method == RedistanceMethod::Pde) return {};
  return ExactReinitialize::regionOfInterest(exactOptions(options), plans, operand, ofResult);
}

std::optional<Cost> ReinitializeOperator::cost(const Options& options, const OperatorPlans& plans) {
  if (options.method == RedistanceMethod::Exact)
    return ExactReinitialize::cost(exactOptions(options), plans);
  constexpr double kSeconds = 3e-7;  // for each grid point and stage
  const double halfWidth = plans.result.halfWidth,
               points = plans.operands[0].layer() * 2 * (flow::pdeReach(halfWidth) + 0.5);
  return Cost{kSeconds * points * options.timeOrder * flow::pdeSteps(halfWidth),
              flow::kPdeBytes * points};
}

}  // namespace levelset
