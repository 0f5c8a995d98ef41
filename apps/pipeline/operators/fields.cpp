#include "apps/pipeline/operators/fields.h"

#include <fmt/core.h>

#include <cmath>

#include "levelset/error.h"
#include "levelset/fields/expression.h"
#include "levelset/fields/grid.h"

namespace pipeline {

levelset::ScalarField scalarField(const Invocation& in, const std::string& param) {
  const auto named = in.named.find(param);
  return levelset::withContext(in.where(param), [&] {
    if (named == in.named.end()) return levelset::scalarExpression(in.text(param));
    if (named->second.kind() == Kind::Band) return levelset::asScalarField(named->second.band());
    return levelset::asScalarField(named->second.field());
  });
}

levelset::VectorField vectorField(const Invocation& in, const std::string& param) {
  const auto named = in.named.find(param);
  return levelset::withContext(in.where(param), [&] {
    if (named == in.named.end()) return levelset::vectorExpression(in.text(param));
    return levelset::asVectorField(named->second.field());
  });
}

levelset::NormalSpeed normalSpeed(const Invocation& in, const std::string& param) {
  if (in.named.contains(param)) return levelset::speedOf(scalarField(in, param));
  return levelset::withContext(in.where(param),
                               [&] { return levelset::speedExpression(in.text(param)); });
}

levelset::Attribute attribute(const Invocation& in, const std::string& param) {
  const auto named = in.named.find(param);
  if (named != in.named.end() && named->second.kind() == Kind::Field &&
      named->second.field().isVector())
    return {.vector = vectorField(in, param)};
  // Check for finite values here, since only here the text of the parameter is known for the
  // message.
  return {.scalar = [scalar = scalarField(in, param), where = in.where(param),
                     text = in.text(param)](const Imath::V3d& p) {
    const double value = scalar(p);
    if (std::isfinite(static_cast<float>(value))) return value;
    throw levelset::InvalidInput(
        fmt::format("{}: '{}' is {} on the surface at {:.6g},{:.6g},{:.6g}; give an attribute that "
                    "is finite on the entire surface",
                    where, text, value, p.x, p.y, p.z));
  }};
}

std::vector<Param> maskParams() {
  return {{.name = "mask",
           .type = ParamType::Scalar,
           .doc = "scalar field that limits the effect of the action: no effect where the field is "
                  "at most --mask-min, full effect where it is at least --mask-max"},
          {.name = "mask-min",
           .type = ParamType::Number,
           .doc = "value of the field --mask up to which the action has no effect",
           .fallback = "0"},
          {.name = "mask-max",
           .type = ParamType::Number,
           .doc = "value of the field --mask from which the action has full effect",
           .fallback = "1"},
          {.name = "mask-invert",
           .type = ParamType::Flag,
           .doc = "invert the mask: full effect up to --mask-min, no effect from --mask-max on"}};
}

std::vector<Param> withMask(std::vector<Param> params) {
  for (Param& param : maskParams()) params.push_back(std::move(param));
  return params;
}

std::optional<levelset::Mask> maskOf(const Invocation& in) {
  if (!in.given("mask")) {
    for (const char* param : {"mask-min", "mask-max", "mask-invert"}) {
      if (in.given(param))
        throw levelset::UsageError(fmt::format(
            "{}: --{} sets a limit or inversion of a mask, but --mask is missing; give --mask",
            in.op().name, param));
    }
    return std::nullopt;
  }
  levelset::Mask mask{.field = scalarField(in, "mask"),
                      .min = in.number("mask-min"),
                      .max = in.number("mask-max"),
                      .invert = in.flag("mask-invert")};
  levelset::checkMask(mask);
  return mask;
}

}  // namespace pipeline
