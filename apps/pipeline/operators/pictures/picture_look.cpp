#include "apps/pipeline/operators/pictures/picture_look.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "apps/pipeline/operators/option_params.h"
#include "levelset/error.h"
#include "render/effects/effects.h"

namespace pipeline {
namespace {

using levelset::UsageError;

struct Preset {
  const char* name;
  const char* use;
  std::vector<std::pair<const char*, const char*>> options;
};

/// Options that each preset sets, in the words of the command line.
const std::vector<Preset>& presets() {
  static const std::vector<Preset> all = {{"paper",
                                           "ink on paper",
                                           {{"style", "ink"},
                                            {"outline", "1.5"},
                                            {"crease-angle", "50"},
                                            {"line-colour", "0.12,0.10,0.09"},
                                            {"background", "0.93,0.91,0.86"},
                                            {"reduce", "3"},
                                            {"samples", "1"}}},
                                          {"clay",
                                           "unglazed clay under a large lamp",
                                           {{"style", "lit"},
                                            {"colour", "0.86,0.72,0.62"},
                                            {"light-radius", "20"},
                                            {"ground", ""},
                                            {"background", "0.95,0.94,0.92"},
                                            {"samples", "16"}}},
                                          {"technical",
                                           "a technical illustration",
                                           {{"style", "tone"},
                                            {"outline", "2"},
                                            {"crease-angle", "25"},
                                            {"background", "1,1,1"},
                                            {"reduce", "3"},
                                            {"samples", "1"}}},
                                          {"molecule",
                                           "the surface of a molecule",
                                           {{"style", "lit"},
                                            {"colour", "0.55,0.74,0.86"},
                                            {"light-radius", "15"},
                                            {"outline", "1.6"},
                                            {"crease-angle", "180"},
                                            {"outline-step", "1%"},
                                            {"depth-cue", "0.6"},
                                            {"background", "1,1,1"},
                                            {"reduce", "3"},
                                            {"samples", "1"}}},
                                          {"xray",
                                           "a radiograph of solids",
                                           {{"style", "tone"},
                                            {"xray", "15%"},
                                            {"background", "0,0,0"},
                                            {"reduce", "3"},
                                            {"samples", "1"}}}};
  return all;
}

/// Requires parts whose thickness is measured. @throws UsageError
void requireThickness(const Invocation& in, const render::Scene& scene) {
  if (scene.quadrics.empty() && scene.beziers.empty() && scene.mapped.empty() &&
      scene.terrains.empty())
    return;
  throw UsageError(fmt::format(
      "render: --xray needs level sets or meshes, but the scene has quadrics, Bézier volumes, "
      "terrains or mapped textures; {}",
      in.isAssumed("xray") ? "use another --preset" : "leave it out"));
}

render::LookOptions lookOf(Invocation& in, OptionStage stage) {
  return readOptions<render::LookOptions>(in, stage);
}

bool isActive(const render::LookOptions& look) {
  return look.outline > 0 || look.halo > 0 || look.depthCue > 0 || look.xray || look.background;
}

Imath::C3f linearColour(const Invocation& in) {
  const Imath::V3d colour = in.point("colour");
  Imath::C3f linear;
  for (int c = 0; c < 3; ++c) {
    if (!(colour[c] >= 0 && colour[c] <= 1))
      throw UsageError(
          fmt::format("render: --colour {} is not a colour; give red, green and blue from 0 to 1",
                      in.text("colour")));
    linear[c] = render::linearFromSrgb(static_cast<float>(colour[c]));
  }
  return linear;
}

/// Sets the colour of --colour or of the preset.
void colourParts(const Invocation& in, render::Scene& scene) {
  const Imath::C3f colour = linearColour(in);
  for (render::Solid& solid : scene.solids) solid.colour = colour;
  for (render::MeshPart& mesh : scene.meshes) mesh.colour = colour;
  for (render::BezierPart& part : scene.beziers) part.colour = colour;
  for (render::TerrainPart& part : scene.terrains) {
    part.colour = colour;
    part.ramp.clear();
  }
  const bool isColoured = !scene.solids.empty() || !scene.meshes.empty() ||
                          !scene.beziers.empty() || !scene.terrains.empty();
  const bool hasOwnColours = !scene.quadrics.empty() || scene.segmented;
  if (!isColoured && hasOwnColours && !in.isAssumed("colour"))
    throw UsageError("render: these parts have their own colours; leave --colour out");
}

}  // namespace

std::string presetText() {
  std::string text;
  for (const Preset& preset : presets()) {
    text += fmt::format("{}{}, {}:", text.empty() ? "" : "; ", preset.name, preset.use);
    for (const auto& [option, value] : preset.options)
      text += fmt::format(" --{}{}{}", option, *value ? " " : "", value);
  }
  return text;
}

void addLookParams(std::vector<Param>& params) {
  std::vector<std::string> names;
  for (const Preset& preset : presets()) names.emplace_back(preset.name);
  const std::vector<Param> own = {
      {.name = "preset",
       .type = ParamType::Choice,
       .doc = "set of options for a purpose; options that are given replace those of the preset",
       .choices = names},
      {.name = "colour",
       .type = ParamType::Point,
       .doc = "display colour of all solids and meshes, red, green and blue from 0 to 1; default: "
              "the colours of the scene"},
      {.name = "light",
       .type = ParamType::Point,
       .doc = "direction towards the key light, x to the right, y upwards, z towards the eye; "
              "default: that of the scene, or else -0.4,0.7,0.6"},
      {.name = "light-radius",
       .type = ParamType::Number,
       .doc = "angle, in degrees, under which the radius of the key light appears, which softens "
              "shadows; default: that of the scene, or else 8.6",
       .range = Range::NonNegative},
      {.name = "occlusion-rays",
       .type = ParamType::Integer,
       .doc = "rays to the sky for each colour sample; 0: no ambient occlusion",
       .fallback = "16",
       .range = Range::NonNegative},
      {.name = "shadow-rays",
       .type = ParamType::Integer,
       .doc = "rays to the key light for each colour sample; 0: no shadows",
       .fallback = "4",
       .range = Range::NonNegative},
      {.name = "light-layers",
       .type = ParamType::Flag,
       .doc = "add layers to the EXR with the traced shares of light that reach the surface: "
              "light.sky and light.key"},
      {.name = "reduce",
       .type = ParamType::Integer,
       .doc = "draw with this many times the width and height, apply the effects, and average "
              "squares of pixels to --size, for smooth lines",
       .fallback = "1",
       .range = Range::Positive}};
  params.insert(params.end(), own.begin(), own.end());
  const std::vector<Param> look = paramsOf<render::LookOptions>();
  params.insert(params.end(), look.begin(), look.end());
}

void assumePreset(Invocation& in) {
  if (!in.given("preset")) return;
  const std::string name = in.text("preset");
  const auto preset = std::find_if(presets().begin(), presets().end(),
                                   [&](const Preset& each) { return name == each.name; });
  for (const auto& [option, value] : preset->options) in.assume(option, value);
  // Another style than that of the preset, its first option, may have no shadows.
  if (in.text("style") != preset->options.front().second) in.dropAssumed("ground");
}

void validateLook(const Invocation& in) {
  Invocation all = in;
  try {
    render::validateReduction(in.integer("reduce"));
    render::validate(lookOf(all, OptionStage::Syntax), in.integerAs<int>("reduce"));
    if (in.given("light-radius")) render::validateLightRadius(in.number("light-radius"));
  } catch (const UsageError& error) {
    throw UsageError(fmt::format("render: {}", error.what()));
  }
  if (in.given("colour")) (void)linearColour(in);
}

bool hasLook(const Invocation& in) {
  Invocation all = in;
  return in.integer("reduce") > 1 || isActive(lookOf(all, OptionStage::Syntax));
}

void applyLookTo(Invocation& in, render::Scene& scene) {
  if (in.given("xray")) requireThickness(in, scene);
  if (in.given("colour")) colourParts(in, scene);
  if (scene.volumePart) in.dropAssumed("ground");  // a volume has no shadow on a ground
  if (in.given("light")) scene.key.direction = in.point("light");
  if (in.given("light-radius")) scene.key.softness = in.radians("light-radius");
  const int scale = in.integerAs<int>("reduce");
  if (scale == 1) return;
  const auto enlarged = [&](int edge) {
    return edge > render::kMaxPixels / scale ? edge : edge * scale;
  };
  scene.camera.width = enlarged(scene.camera.width);
  scene.camera.height = enlarged(scene.camera.height);
}

void applyLookTo(const Invocation& in, render::RenderOptions& options) {
  options.ambientSamples = in.integerAs<int>("occlusion-rays");
  options.shadowSamples = in.integerAs<int>("shadow-rays");
  options.lightLayers = in.flag("light-layers");
  options.thickness = options.thickness || in.given("xray");
  options.layers = options.layers || hasLook(in);
}

render::Image finishLook(Invocation& in, render::Image image) {
  const render::CpuScreenRunner runner;
  const int scale = in.integerAs<int>("reduce");
  image = render::withLook(std::move(image), lookOf(in, OptionStage::Run), scale, runner);
  return scale > 1 ? render::reducedPicture(std::move(image), scale) : image;
}

}  // namespace pipeline
