#include "apps/pipeline/operators/pictures/effect_operator.h"

#include <fmt/core.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/option_params.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "levelset/file_target.h"
#include "render/effects/effects.h"
#include "render/effects/stereo.h"
#include "render/gpu/gpu_effects.h"
#include "render/images/image.h"

namespace pipeline {
namespace {

using levelset::UsageError;

/// An option that has an effect only beside others.
struct Dependence {
  const char* option;
  std::vector<const char*> needed;  // one of these
};

const std::vector<Dependence>& dependences() {
  static const std::vector<Dependence> all = {{"environment", {"reflect", "refract"}},
                                              {"index", {"refract"}},
                                              {"light", {"shadow"}},
                                              {"light-radius", {"shadow"}},
                                              {"occluder-depth", {"occlusion", "shadow"}},
                                              {"occlusion-radius", {"occlusion"}},
                                              {"texture-size", {"solid-texture"}},
                                              {"eye-distance", {"stereo"}},
                                              {"screen-depth", {"stereo"}}};
  return all;
}

/// Refuses options that would be ignored. @throws UsageError
void validateDependences(const Invocation& in) {
  for (const auto& [option, needed] : dependences()) {
    bool isUsed = !in.given(option);
    std::string names;
    for (const char* name : needed) {
      isUsed = isUsed || (in.given(name) && in.text(name) != "none");
      names += fmt::format("{}--{}", names.empty() ? "" : " or ", name);
    }
    if (!isUsed)
      throw UsageError(fmt::format("effect: --{} is for {}; give {}, or leave it out", option,
                                   names, needed.size() > 1 ? "one of them" : "that, too"));
  }
  for (const char* option : {"eye-distance", "screen-depth"})
    if (in.given(option) && in.given("right"))
      throw UsageError(fmt::format(
          "effect: --right is a drawn picture, whose eye --{0} does not move; leave --{0} out",
          option));
}

void validateEffect(const Invocation& in) {
  Invocation all = in;
  try {
    const auto options = readOptions<render::EffectOptions>(all, OptionStage::Syntax);
    render::validate(options);
    render::validate(readOptions<render::LookOptions>(all, OptionStage::Syntax), options.reduce);
  } catch (const UsageError& error) {
    throw UsageError(fmt::format("effect: {}", error.what()));
  }
  if (render::imageFormat(in.text("write"), in.text("format")).empty())
    throw UsageError(
        fmt::format("effect: '{}' is of no known format; use .exr or .png, or --format",
                    in.text(in.given("format") ? "format" : "write")));
  if (in.given("right") && (!in.given("stereo") || in.text("stereo") == "none"))
    throw UsageError(
        "effect: --right is the picture of the right eye; give --stereo, too, or leave it out");
  validateDependences(in);
}

render::Image combined(Invocation& in, const render::LookOptions& look,
                       render::EffectOptions options, const render::ScreenRunner& runner) {
  render::Image image = render::readExr(in.text("picture"), in.maxMemory);
  if (!in.given("right"))
    return render::withEffects(std::move(image), look, options, runner, in.maxMemory);
  const render::Stereo kind = std::exchange(options.stereo, render::Stereo::None);
  const render::Image left =
      render::withEffects(std::move(image), look, options, runner, in.maxMemory);
  const render::Image right = render::withEffects(render::readExr(in.text("right"), in.maxMemory),
                                                  look, options, runner, in.maxMemory);
  return render::stereoPicture(left, right, kind);
}

Value runEffect(Invocation& in) {
  const auto look = readOptions<render::LookOptions>(in, OptionStage::Run);
  const auto options = readOptions<render::EffectOptions>(in, OptionStage::Run);
  const std::unique_ptr<render::ScreenRunner> runner =
      in.text("renderer") == "gpu" ? render::makeGpuScreenRunner()
                                   : std::make_unique<render::CpuScreenRunner>();
  render::writeImage(in.text("write"), combined(in, look, options, *runner), in.text("format"));
  return Value(Plan{});
}

}  // namespace

Operator effectOperator() {
  Operator op = {
      .name = "effect",
      .group = "Pictures",
      .summary = "add outlines, shadows, reflections and other effects to an EXR picture",
      .details =
          "The effects are computed from the layers of an EXR that 'render' wrote, and from the "
          "camera in its header. What the picture does not show, behind its surfaces and outside "
          "its frame, has no effect. Of the EXR that is written, the layers outline, light.sky and "
          "light.key are those of --outline, --occlusion and --shadow. Without these options, "
          "light.sky and light.key are the traced ones of 'render --light-layers', if any.",
      .example =
          "levelsmith torus --radius 2 --tube 0.8 --voxel 0.1 ! render torus.exr --size 320x240 "
          "! effect torus.exr torus.png --outline 2 --occlusion 0.7 --background 1,1,1",
      .params = {{.name = "picture",
                  .type = ParamType::Path,
                  .doc = "EXR with the layers that 'render' writes",
                  .required = true,
                  .position = 0},
                 {.name = "write",
                  .type = ParamType::Path,
                  .doc = "picture to write, .exr or .png, or - for standard output",
                  .required = true,
                  .position = 1}},
      .flow = Flow::PassesThrough,
      .run = runEffect,
      .plan = [](Invocation&) { return Plan{}; },
      .validate = validateEffect,
      .targets = [](const Invocation& in) { return std::vector<std::string>{in.text("write")}; },
      .usesStandardOutput =
          [](const Invocation& in) { return levelset::isStandardOutput(in.text("write")); },
  };
  for (const auto& params : {paramsOf<render::LookOptions>(), paramsOf<render::EffectOptions>()})
    op.params.insert(op.params.end(), params.begin(), params.end());
  const std::vector<Param> last = {
      {.name = "right",
       .type = ParamType::Path,
       .doc = "with --stereo: EXR as seen by the right eye; the first one is that of the left eye"},
      {.name = "renderer",
       .type = ParamType::Choice,
       .doc = "processor of outlines, occlusion and shadows: cpu, or gpu with a compute shader",
       .fallback = "cpu",
       .choices = {"cpu", "gpu"}},
      {.name = "format",
       .type = ParamType::Text,
       .doc = "format of the picture: exr or png; default: by its extension"}};
  op.params.insert(op.params.end(), last.begin(), last.end());
  return op;
}

}  // namespace pipeline
