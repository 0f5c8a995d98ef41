#include <fmt/core.h>

#include "levelset/error.h"
#include "levelset/evolve/evolve.h"

namespace levelset {

const OperatorText EvolveOperator::text{
    .name = "evolve",
    .group = "Flow",
    .summary = "move a surface along its normals with a speed given by a formula or a field",
    .details =
        "Solves the level-set equation phi_t + F |grad phi| = 0. The surface moves outwards where "
        "F > 0. F may change its sign and may depend on place, time, normal and curvature; -k is "
        "the curvature flow. A speed that grows with k is refused. For a grid, write read FILE.vdb "
        "--grid NAME --as f and then --speed @f. A solid that vanishes is an error, and the "
        "message "
        "gives the time.",
    .example =
        "levelsmith sphere --radius 1 --voxel 0.1 ! evolve --speed \"0.5*nz - 0.1*k\" --time 0.2 ! "
        "measure"};

void EvolveOperator::check(const Options& options, const GivenOptions& given) {
  if (options.cfl > 1)
    throw UsageError(
        fmt::format("--cfl is {}; give a Courant number of at most 1, so that the scheme is stable",
                    options.cfl));
  if (given("points") != given("radius"))
    throw UsageError(
        "--points and --radius together limit the motion to the surroundings of points; give both "
        "or neither");
}

NarrowBand EvolveOperator::run(std::vector<NarrowBand> operands, const Options& options,
                               OperatorRun& run) {
  EvolveOptions settings{.start = options.start,
                         .order = options.order,
                         .timeOrder = options.timeOrder,
                         .cfl = options.cfl,
                         .mask = options.mask,
                         .maxMemory = run.maxMemory,
                         .progress = run.progress};
  if (options.radius) settings.near = {options.points, *options.radius};
  NarrowBand band = std::move(operands[0]);
  operands.clear();
  EvolveResult result = evolve(std::move(band), options.speed, options.time, settings);
  run.figures = {{"steps", result.steps}, {"redistances", result.redistances}};
  run.notes.push_back(
      fmt::format("{} steps, redistanced {} times", result.steps, result.redistances));
  return std::move(result.band);
}

}  // namespace levelset
