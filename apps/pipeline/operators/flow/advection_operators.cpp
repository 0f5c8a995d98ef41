#include "levelset/flow/advect.h"

#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "apps/pipeline/operators/fields.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "levelset/fields/expression.h"
#include "levelset/flow/velocity.h"

namespace pipeline {
namespace {

using levelset::AdvectScheme;
using levelset::UsageError;

std::function<double(double)> factorOf(const Invocation& in) {
  return levelset::timeExpression(in.text("factor"), in.where("factor").c_str());
}

void validateAdvect(const Invocation& in) {
  if (in.given("factor")) (void)factorOf(in);
  const std::string field = in.text("field");
  const bool named = field == "enright" || field == "vortex" || field == "rotation";
  if (in.given("period") && !named)
    throw UsageError(
        "advect: --period is that of a velocity known by its name; write the time into the formula "
        "or use --factor");
  for (const char* param : {"center", "axis"}) {
    if (in.given(param) && field != "rotation")
      throw UsageError(fmt::format(
          "advect: --{} is that of the rotation; leave it out, or use --field rotation", param));
  }
}

levelset::VectorField velocityOf(const Invocation& in) {
  const std::string field = in.text("field");
  const auto period = [&](double usual) {
    return in.given("period") ? in.number("period") : usual;
  };
  levelset::VectorField velocity =
      field == "enright"  ? levelset::enrightVelocity(period(3))
      : field == "vortex" ? levelset::vortexVelocity(period(8))
      : field == "rotation"
          ? levelset::rotationVelocity(in.point("center"), in.point("axis"), period(1))
          : vectorField(in, "field");
  if (!in.given("factor")) return velocity;
  return [velocity, factor = factorOf(in)](const Imath::V3d& p, double time) {
    return velocity(p, time) * factor(time);
  };
}

Value advect(Invocation& in) {
  const std::string scheme = in.text("scheme");
  levelset::AdvectOptions options{.start = in.number("start"),
                                  .fixVolume = in.flag("fix-volume"),
                                  .mask = maskOf(in),
                                  .maxMemory = in.maxMemory,
                                  .progress = in.progress};
  options.scheme = scheme == "upwind"            ? AdvectScheme::Upwind
                   : scheme == "semi-lagrangian" ? AdvectScheme::SemiLagrangian
                                                 : AdvectScheme::Front;
  levelset::AdvectResult result =
      levelset::advect(in.band(), velocityOf(in), in.number("time"), options);
  const double change = result.volumeAfter / result.volumeBefore - 1;
  nlohmann::ordered_json json;
  json["steps"] = result.steps;
  json["volume_before"] = result.volumeBefore;
  json["volume_after"] = result.volumeAfter;
  in.notes.detailsJson = json.dump();
  in.notes.notes.push_back(fmt::format("{} steps, the volume changed by {:+.3g} %{}", result.steps,
                                       100 * change,
                                       options.fixVolume ? " before it was fixed" : ""));
  return Value(std::move(result.band));
}

}  // namespace

void addAdvectionOperators(std::vector<Operator>& all) {
  all.push_back({
      .name = "advect",
      .group = "Flow",
      .summary = "carry a solid along with a velocity",
      .details =
          "The velocity is one known by its name, three formulas in x, y, z, r and t, or a field "
          "of "
          "vectors (read FILE.vdb --grid NAME --as v, then --field @v), staggered or not. A "
          "negative time runs backwards. The scheme 'front' moves the surface as triangles and "
          "keeps volume and thin sheets; the two others work on the grid.",
      .example = "levelsmith sphere --radius 0.15 --center 0.35,0.35,0.35 --voxel 0.03 ! advect "
                 "--field enright --time 0.3 ! measure",
      .params = withMask(
          {{.name = "field",
            .type = ParamType::Velocity,
            .doc = "the velocity, world units per unit of time",
            .choices = {"enright", "rotation", "vortex"},
            .required = true},
           {.name = "time",
            .type = ParamType::Number,
            .doc = "how long; negative: backwards",
            .required = true},
           {.name = "start",
            .type = ParamType::Number,
            .doc = "time of the velocity at which it begins",
            .fallback = "0"},
           {.name = "scheme",
            .type = ParamType::Choice,
            .doc = "how",
            .fallback = "front",
            .choices = {"front", "semi-lagrangian", "upwind"}},
           {.name = "period",
            .type = ParamType::Number,
            .doc = "of a velocity known by its name; default: enright 3, vortex 8, rotation 1",
            .range = Range::Positive},
           {.name = "center",
            .type = ParamType::Point,
            .doc = "of the rotation",
            .fallback = "0,0,0"},
           {.name = "axis",
            .type = ParamType::Point,
            .doc = "of the rotation",
            .fallback = "0,0,1"},
           {.name = "factor",
            .type = ParamType::Text,
            .doc = "formula in t that the velocity is multiplied by"},
           {.name = "fix-volume",
            .type = ParamType::Flag,
            .doc = "offset the result to the volume of the solid"}}),
      .operands = {{Kind::Band}},
      .run = advect,
      .validate = validateAdvect,
  });
}

}  // namespace pipeline
