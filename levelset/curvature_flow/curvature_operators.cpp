#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/curvature_flow/curvature_flow.h"
#include "levelset/curvature_flow/smooth.h"
#include "levelset/distance/redistance.h"
#include "levelset/distance/sweep_width.h"

namespace levelset {

const OperatorText CurvatureFlowOperator::text{
    .name = "curvature-flow",
    .group = "Flow",
    .summary = "move the surface inwards with its curvature k1 + k2",
    .details =
        "A ball obeys R² = R0² - 4 time. Topology may change; a solid that vanishes is an error, "
        "and the message gives the time. Steps are as long as the tolerance allows, and always "
        "stable. If the error exceeds the tolerance, the result is still written, and the exit "
        "code is 5. A flow with --volume-preserving comes to rest.",
    .example = "levelsmith box --size 2,2,2 --voxel 0.1 ! curvature-flow --time 0.05 ! measure"};

NarrowBand CurvatureFlowOperator::run(std::vector<NarrowBand> operands, const Options& options,
                                      OperatorRun& run) {
  const CurvatureFlowOptions settings{.scheme = options.scheme,
                                      .preservesVolume = options.preservesVolume,
                                      .mask = options.mask,
                                      .tolerance = options.tolerance,
                                      .step = options.step,
                                      .maxMemory = run.maxMemory,
                                      .progress = run.progress};
  NarrowBand band = std::move(operands[0]);
  operands.clear();
  CurvatureFlowResult result = curvatureFlow(std::move(band), options.time, settings);
  run.notes.push_back(fmt::format("{} steps, {} evaluations of the curvature, redistanced {} times",
                                  result.steps, result.evaluations, result.redistances));
  run.errors.push_back({"time steps, rms over the surface", result.errorEstimate, "world units"});
  if (result.restedAfter)
    run.notes.push_back(fmt::format(
        "the surface is at rest after a time of {:.4g} world units squared", *result.restedAfter));
  if (options.tolerance && result.errorEstimate > *options.tolerance)
    run.failure = fmt::format(
        "the error of the time steps is about {:.3g} world units, more than the tolerance of "
        "{:.3g}: the tolerance shortens no step below {:.3g}; give a shorter --step or a larger "
        "--tolerance",
        result.errorEstimate, *options.tolerance, result.shortestStep);
  return std::move(result.band);
}

/// The estimate assumes FlowScheme::Stabilized, whose number of stages grows with the square root
/// of the time.
std::optional<Cost> CurvatureFlowOperator::cost(const Options& options,
                                                const OperatorPlans& plans) {
  const ValuePlan& solid = plans.operands[0];
  const double voxels = solid.activeVoxels();
  const double stages = std::sqrt(options.time) / solid.voxelSize;
  return Cost{1e-9 * voxels * (3400 + 540 * stages), 300 * voxels};
}

const OperatorText SmoothOperator::text{
    .name = "smooth",
    .group = "Flow",
    .summary = "smooth the surface by a filter of its distances",
    .details =
        "--kind gaussian is a Gaussian with the standard deviation --sigma. mean is a box of the "
        "same variance. median is the median over the grid points within sigma, which is slow for "
        "a large sigma. taubin is a Gaussian, then a sharpening that restores the amplitude of "
        "long waves.",
    .example = "levelsmith box --size 2,2,2 --voxel 0.1 ! smooth --sigma 1vx ! measure"};

NarrowBand SmoothOperator::run(std::vector<NarrowBand> operands, const Options& options,
                               OperatorRun& run) {
  NarrowBand band = std::move(operands[0]);
  operands.clear();
  return smooth(std::move(band), options.kind, options.sigma,
                {.mask = options.mask, .maxMemory = run.maxMemory, .progress = run.progress});
}

RegionOfInterest SmoothOperator::regionOfInterest(const Options& options,
                                                  const OperatorPlans& plans, std::size_t,
                                                  const RegionOfInterest& ofResult) {
  if (options.mask) return {};
  const ValuePlan& solid = plans.operands[0];
  const double voxel = solid.voxelSize;
  const double reach = smoothingReach(options.kind, options.sigma / voxel, solid.halfWidth);
  return {.region = grown(ofResult.region, reach * voxel)};
}

/// Adds the costs of three stages: the band is widened to the width that the filter reads,
/// filtered, and redistanced.
std::optional<Cost> SmoothOperator::cost(const Options& options, const OperatorPlans& plans) {
  const ValuePlan& solid = plans.operands[0];
  const double layer = solid.layer(), sigma = options.sigma / solid.voxelSize;
  const double own = solid.halfWidth, read = smoothingWidth(options.kind, sigma);
  const double width = std::max(own, read);
  Cost cost;
  if (read > own) cost = costOfDistances(layer, width);
  const double taps = options.kind == SmoothKind::Median
                          ? 8 * 4.2 * std::pow(std::max(1.0, sigma), 3)
                          : 3 * (8 * sigma + 1) * (options.kind == SmoothKind::Taubin ? 2 : 1);
  // The grid and two arrays; Taubin smoothing and blending with a mask hold a third.
  const double arrays = options.kind == SmoothKind::Taubin || options.mask ? 24 : 18;
  cost += {0.5e-9 * taps * 2 * width * layer, layer * (20 + arrays * 2 * width)};
  // A distance transform sweeps the grid along x.
  Cost last = costOfDistances(layer, own);
  const double extent = plans.result.bounds.size().x / plans.result.voxelSize;
  if (extent > kSweepWidth) last.bytes *= kSweepWidth / extent;
  last.bytes += 100 * layer;
  return cost += last;
}

}  // namespace levelset
