#include <fmt/core.h>

#include "levelset/distance/closest_points.h"
#include "levelset/distance/redistance.h"
#include "levelset/eikonal/arrival.h"
#include "levelset/error.h"

namespace levelset {
namespace {

constexpr const char* kFrontDetails =
    "Solves |grad T| F = 1 for the times T at which a front of speed F arrives. The front starts "
    "at the surface and moves to both sides (times are negative inside), or it starts at points. "
    "Without --speed, --from and --extend, the times are distances and the result is a band; "
    "`rebuild-band` computes these distances from closest points, more accurately. Otherwise the "
    "result is a field. The front does not pass where the speed is zero, negative or NaN.";

void noteFigures(const FrontOptions& options, const ArrivalFigures& figures, OperatorRun& run) {
  run.notes.push_back(fmt::format("{} grid points reached", figures.reached));
  if (options.order == 2)
    run.notes.push_back(
        fmt::format("{} grid points fell back to first order on some axis", figures.firstOrder));
  run.figures = {{"reached", figures.reached},
                 {"started", figures.started},
                 {"first_order", figures.firstOrder}};
}

FieldGrid extendAttribute(const NarrowBand& solid, const FrontOptions& options, OperatorRun& run) {
  const ClosestPointOptions settings{
      .halfWidth = options.to.in(solid.voxelSize()) / solid.voxelSize(),
      .maxMemory = run.maxMemory,
      .progress = run.progress};
  run.notes.push_back("each grid point has the attribute of its closest point on the surface");
  return options.extend.vector ? extendOffSurface(solid, options.extend.vector, settings)
                               : extendOffSurface(solid, options.extend.scalar, settings);
}

}  // namespace

template <FrontMethod method>
void FrontOperator<method>::check(const Options&, const GivenOptions& given) {
  for (const char* other : {"speed", "from", "order"})
    if (given("extend") && given(other))
      throw UsageError(
          fmt::format("--extend computes an attribute instead of arrival times, so it cannot be "
                      "combined with --{}; leave out one of the two",
                      other));
}

template <FrontMethod method>
std::variant<NarrowBand, FieldGrid> FrontOperator<method>::run(std::vector<NarrowBand> operands,
                                                               const Options& options,
                                                               OperatorRun& run) {
  const NarrowBand& solid = operands[0];
  if (options.extend) return extendAttribute(solid, options, run);
  const double reach = options.to.in(solid.voxelSize());
  const ArrivalOptions settings{.method = method,
                                .order = options.order,
                                .speed = options.speed,
                                .maxMemory = run.maxMemory,
                                .progress = run.progress};
  if (makesField(options)) {
    ArrivalTimes result = options.from.empty()
                              ? arrivalTimes(solid, reach, settings)
                              : arrivalTimesFromPoints(solid, options.from, reach, settings);
    noteFigures(options, result.figures, run);
    return std::move(result.times);
  }
  FrontDistance result = frontDistance(solid, reach, settings);
  noteFigures(options, result.figures, run);
  return std::move(result.band);
}

template <FrontMethod method>
ValuePlan FrontOperator<method>::plan(const Options& options, Plans operands, const OperatorRun&) {
  constexpr double kBytes = 8;  // bytes for each active voxel of a field
  ValuePlan plan = operands[0];
  plan.halfWidth = options.to.in(plan.voxelSize) / plan.voxelSize;
  if (makesField(options)) plan.fieldBytes = plan.activeVoxels() * kBytes;
  return plan;
}

template <FrontMethod method>
std::optional<Cost> FrontOperator<method>::cost(const Options& options,
                                                const OperatorPlans& plans) {
  const ValuePlan& solid = plans.operands[0];
  const double reach = options.to.in(solid.voxelSize) / solid.voxelSize,
               voxels = solid.layer() * 2 * reach;
  if (!options.from.empty()) return {};  // the cost depends on the unknown volume around the points
  if (options.extend) return costOfDistances(solid.layer(), reach);
  return Cost{1e-9 * (method == FrontMethod::Marching ? 1400 : 550) * voxels, 12 * voxels};
}

template struct FrontOperator<FrontMethod::Marching>;
template struct FrontOperator<FrontMethod::Sweeping>;

const OperatorText FastMarchingOperator::text{
    .name = "fast-marching",
    .group = "Distances",
    .summary = "compute arrival times and distances by fast marching",
    .details = kFrontDetails,
    .example =
        "levelsmith sphere --radius 1 --voxel 0.05 ! fast-marching --speed \"1 + 0.5*x\" "
        "--to 0.4 ! info",
    .formerName = "march"};

const OperatorText FastSweepingOperator::text{
    .name = "fast-sweeping",
    .group = "Distances",
    .summary = "compute arrival times and distances by fast sweeping",
    .details = kFrontDetails,
    .example = "levelsmith sphere --radius 1 --voxel 0.05 ! fast-sweeping --to 8vx ! check",
    .formerName = "sweep"};

}  // namespace levelset
