#include <fmt/core.h>

#include "levelset/advection/advect.h"
#include "levelset/advection/grid_schemes.h"
#include "levelset/error.h"
#include "levelset/fields/expression.h"

namespace levelset {
namespace {

std::function<double(double)> factorOf(const AdvectOperator::Options& options) {
  return withContext("--factor", [&] { return timeExpression(options.factor); });
}

VectorField velocityOf(const AdvectOperator::Options& options) {
  const std::string& name = options.field.name;
  const auto period = [&](double usual) { return options.period.value_or(usual); };
  VectorField velocity = name == "enright"  ? enrightVelocity(period(3))
                         : name == "vortex" ? vortexVelocity(period(8))
                         : name == "rotation"
                             ? rotationVelocity(options.center, options.axis, period(1))
                             : options.field.field;
  if (options.factor.empty()) return velocity;
  return [velocity, factor = factorOf(options)](const Imath::V3d& p, double time) {
    return velocity(p, time) * factor(time);
  };
}

}  // namespace

const OperatorText AdvectOperator::text{
    .name = "advect",
    .group = "Flow",
    .summary = "move a solid with a velocity field",
    .details =
        "The velocity is built in (enright, vortex or rotation), or three formulas in x, y, z, r "
        "and t, or a grid of vectors, staggered or not. For a grid, write read FILE.vdb --grid "
        "NAME --as v and then --field @v. A negative time runs backwards. The scheme 'front' moves "
        "the surface as triangles and keeps volume and "
        "thin sheets; 'semi-lagrangian' and 'upwind' work on the grid.",
    .example =
        "levelsmith sphere --radius 0.15 --center 0.35,0.35,0.35 --voxel 0.03 ! advect "
        "--field enright --time 0.3 ! measure"};

void AdvectOperator::check(const Options& options, const GivenOptions& given) {
  if (given("factor")) (void)factorOf(options);
  if (given("period") && options.field.name.empty())
    throw UsageError(
        "--period applies only to the built-in velocities enright, vortex and rotation; write the "
        "time into the formula or use --factor");
  for (const char* option : {"order", "time-order"})
    if (given(option) && options.scheme != AdvectScheme::Upwind)
      throw UsageError(fmt::format(
          "--{} applies only to the upwind scheme; leave it out, or use --scheme upwind", option));
  flow::requireOrders({options.order, options.timeOrder});
  for (const char* option : {"center", "axis"}) {
    if (given(option) && options.field.name != "rotation")
      throw UsageError(fmt::format(
          "--{} applies only to the rotation; leave it out, or use --field rotation", option));
  }
}

NarrowBand AdvectOperator::run(std::vector<NarrowBand> operands, const Options& options,
                               OperatorRun& run) {
  const AdvectOptions settings{.start = options.start,
                               .scheme = options.scheme,
                               .order = options.order,
                               .timeOrder = options.timeOrder,
                               .fixVolume = options.fixVolume,
                               .mask = options.mask,
                               .maxMemory = run.maxMemory,
                               .progress = run.progress};
  AdvectResult result = advect(operands[0], velocityOf(options), options.time, settings);
  const double change = result.volumeAfter / result.volumeBefore - 1;
  run.figures = {{"steps", result.steps},
                 {"volume_before", result.volumeBefore},
                 {"volume_after", result.volumeAfter}};
  run.notes.push_back(fmt::format("{} steps, the volume changed by {:+.3g} %{}", result.steps,
                                  100 * change,
                                  options.fixVolume ? " before --fix-volume corrected it" : ""));
  return std::move(result.band);
}

}  // namespace levelset
