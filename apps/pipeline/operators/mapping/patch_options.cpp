#include "apps/pipeline/operators/mapping/patch_options.h"

#include <fmt/core.h>

#include <charconv>

#include "levelset/error.h"

namespace pipeline {
namespace {

using levelset::UsageError;

constexpr long kMostLayers = 1000;

mapping::LayerScheme schemeOf(const Invocation& in) {
  const std::string name = in.text("particles");
  if (name == "conforming") return mapping::LayerScheme::Conforming;
  return name == "spline" ? mapping::LayerScheme::Spline : mapping::LayerScheme::Reduced;
}

}  // namespace

std::vector<Param> withLayers(std::vector<Param> params) {
  const std::vector<Param> layers = {
      {.name = "height",
       .type = ParamType::Length,
       .doc = "height of the top layer above the surface; 'auto': the height that keeps the "
              "proportions of the texture",
       .range = Range::Positive,
       .required = true,
       .allowsAuto = true},
      {.name = "layers",
       .type = ParamType::Integer,
       .doc = "number of layers of particles, from the surface to the height; at least 2",
       .fallback = "6",
       .range = Range::Positive,
       .formerName = "levels"},
      {.name = "particles",
       .type = ParamType::Choice,
       .doc =
           "arrangement of the particles: reduced, each layer is relaxed separately; conforming, "
           "particles follow the gradient of the distance; spline, they follow a curve",
       .fallback = "reduced",
       .choices = {"reduced", "conforming", "spline"}},
      {.name = "twist",
       .type = ParamType::Degrees,
       .doc =
           "rotation of the top layer about the axis of the patch, anticlockwise seen from outside",
       .fallback = "0"},
      {.name = "taper",
       .type = ParamType::Number,
       .doc = "ratio of the width of the top layer to the width at the surface",
       .fallback = "1",
       .range = Range::Positive},
      {.name = "bend",
       .type = ParamType::Degrees,
       .doc = "angle by which the axis of the patch leans towards u at the top layer",
       .fallback = "0"},
      {.name = "spacing",
       .type = ParamType::Length,
       .doc = "distance between neighbouring particles; default: chosen from the sizes of the "
              "patch and the voxels",
       .range = Range::Positive}};
  params.insert(params.end(), layers.begin(), layers.end());
  return params;
}

void validateLayers(const Invocation& in) {
  const std::string& name = in.op().name;
  if (in.text("particles") != "spline" && (in.given("spline") || in.given("fade")))
    throw UsageError(fmt::format("{}: --spline and --fade need --particles spline", name));
  for (const char* option : {"directions", "parallel"})
    if (in.given(option) && in.text("particles") != "reduced")
      throw UsageError(fmt::format("{}: --{} needs --particles reduced", name, option));
  if (in.given("directions") && in.given("parallel"))
    throw UsageError(
        fmt::format("{}: --directions and --parallel exclude each other; give one of them", name));
  if (in.text("particles") == "spline" && in.text("height") == "auto") {
    throw UsageError(
        fmt::format("{}: --height auto does not work with --particles spline; give the length "
                    "along the spline as --height",
                    name));
  }
  const long layers = in.integer("layers");
  if (layers < 2 || layers > kMostLayers) {
    throw UsageError(
        fmt::format("{}: --layers {} is out of range; give 2 to {}", name, layers, kMostLayers));
  }
}

mapping::PatchOptions patchOptionsOf(Invocation& in) {
  mapping::PatchOptions options = {.layers = static_cast<std::size_t>(in.integer("layers")),
                                   .scheme = schemeOf(in),
                                   .fade = in.given("fade"),
                                   .spacing = in.given("spacing") ? in.length("spacing") : 0,
                                   .mirror = in.flag("mirror"),
                                   .maxMemory = in.maxMemory,
                                   .progress = in.progress};
  if (in.given("spline")) options.spline = in.points("spline");
  if (in.given("directions")) options.directions = in.points("directions");
  options.parallel = in.given("parallel");
  options.transform = {
      .twist = in.radians("twist"), .taper = in.number("taper"), .bend = in.radians("bend")};
  return options;
}

std::array<double, 2> patchSizeOf(Invocation& in) {
  const std::vector<double> size = in.lengths("size");
  for (const double side : size) {
    if (side > 10 * in.operands[0].diagonal()) {
      throw levelset::InvalidInput(fmt::format(
          "{}: --size {} is over ten times the diagonal of the solid, {:.6g}; give a smaller size",
          in.op().name, in.text("size"), in.operands[0].diagonal()));
    }
  }
  return {size[0], size[1]};
}

std::array<std::size_t, 2> countOf(const Invocation& in) {
  const std::string text = in.text("count");
  std::array<std::size_t, 2> count = {0, 0};
  const char *at = text.data(), *end = text.data() + text.size();
  const auto first = std::from_chars(at, end, count[0]);
  const bool hasComma = first.ec == std::errc() && first.ptr != end && *first.ptr == ',';
  const auto second = hasComma ? std::from_chars(first.ptr + 1, end, count[1]) : first;
  if (!hasComma || second.ec != std::errc() || second.ptr != end || count[0] == 0 || count[1] == 0)
    throw UsageError(
        fmt::format("{}: '{}' is not a pair of positive integers; write numbers of tiles, as 12,3",
                    in.where("count"), text));
  return count;
}

std::vector<mapping::PatchOutline> outlinesOf(const std::vector<mapping::Patch>& patches) {
  std::vector<mapping::PatchOutline> outlines;
  outlines.reserve(patches.size());
  for (const mapping::Patch& one : patches) outlines.push_back(mapping::outlineOf(one));
  return outlines;
}

void tellOrigin(const Invocation& in, PatchRecipe& recipe) {
  recipe.action = in.op().name;
  const auto written = [&](const Param& param) -> std::string {
    if (param.type == ParamType::Flag || param.type == ParamType::Points)
      return in.given(param.name) ? "given" : "none";  // points of a spline move with the patch, so
                                                       // their values are not compared
    if (param.type == ParamType::Number) return fmt::format("{}", in.number(param.name));
    if (param.type == ParamType::Degrees) return fmt::format("{}", in.radians(param.name));
    return in.given(param.name) || !param.fallback.empty() ? in.text(param.name) : "none";
  };
  const bool isGrid = recipe.action == "patch-grid";
  for (const Param& param : in.op().params) {
    const std::string& name = param.name;
    const bool isShape = name == "twist" || name == "taper" || name == "bend" || name == "spline" ||
                         name == "fade" || name == "directions" || name == "parallel" ||
                         (isGrid && (name == "count" || name == "shift" || name == "mirror"));
    if (isShape) recipe.shape[name] = written(param);
    if (name == "particles" || name == "spacing") recipe.fineness[name] = written(param);
  }
}

}  // namespace pipeline
