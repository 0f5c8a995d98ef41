#include "apps/pipeline/operators/pictures/picture_optics.h"

#include <fmt/core.h>

#include <algorithm>
#include <string>

#include "apps/pipeline/operators/option_params.h"
#include "levelset/error.h"
#include "render/effects/effects.h"
#include "render/effects/stereo.h"
#include "render/shading/optics_options.h"

namespace pipeline {
namespace {

using levelset::UsageError;

/// Depths of the nearest and the farthest surface of a scene, for the defaults of the eyes.
/// @throws UsageError if a surface reaches behind the camera
Imath::V2d depthsOf(const render::Scene& scene) {
  const render::Camera& camera = scene.camera;
  const Imath::V3d axis = camera.axis();
  const std::vector<double> extents = scene.extents({-axis, axis});
  const double eye = camera.from.dot(axis), near = std::max(-extents[0] - eye, camera.near),
               far = std::min(extents[1] - eye, camera.farthest());
  if (!(near > 0) || !(far >= near))
    throw UsageError(
        "render: the eye of --stereo is among the surfaces, or the scene has none, so its defaults "
        "are unknown; give --eye-distance and --screen-depth");
  return {near, far};
}

}  // namespace

void addOpticsParams(std::vector<Param>& params) {
  for (const auto& more : {paramsOf<render::OpticsOptions>(), paramsOf<render::StereoOptions>()})
    params.insert(params.end(), more.begin(), more.end());
}

bool isStereo(const Invocation& in) {
  return in.given("stereo") && in.text("stereo") != "none";
}

bool hasOptics(const Invocation& in) {
  Invocation all = in;
  return opticsOf(all).isActive();
}

render::OpticsOptions opticsOf(Invocation& in) {
  return readOptions<render::OpticsOptions>(in, OptionStage::Syntax);
}

void validateOptics(const Invocation& in) {
  Invocation all = in;
  try {
    render::validate(opticsOf(all));
  } catch (const UsageError& error) {
    throw UsageError(fmt::format("render: {}", error.what()));
  }
  for (const char* option : {"environment", "bounces"})
    if (in.given(option) && !opticsOf(all).isActive())
      throw UsageError(
          fmt::format("render: --{} is for --reflect or --refract; give one of them, or leave it "
                      "out",
                      option));
  if (in.given("index") && !(opticsOf(all).refract > 0))
    throw UsageError("render: --index is for --refract; give that, too, or leave it out");
  if (!isStereo(in)) {
    for (const char* option : {"eye-distance", "screen-depth"})
      if (in.given(option))
        throw UsageError(
            fmt::format("render: --{} is for --stereo; give that, too, or leave it out", option));
    return;
  }
  if (in.given("ortho"))
    throw UsageError(
        "render: --stereo needs a view in perspective; leave --ortho out, or leave --stereo out");
  if (in.text("renderer") == "both")
    throw UsageError(
        "render: --renderer both compares one picture, but --stereo draws two; give --renderer "
        "cpu, gpu or embree");
  for (const char* layer : {"thickness", "directions", "light-layers"})
    if (in.flag(layer))
      throw UsageError(
          fmt::format("render: a stereo picture has no layers but its colours, so --{} would be "
                      "lost; leave it out",
                      layer));
}

render::Image drawStereo(Invocation& in, const render::Scene& scene,
                         const std::function<render::Image(const render::Scene&, int)>& draw) {
  const auto options = readOptions<render::StereoOptions>(in, OptionStage::Run);
  const bool hasDefault = !options.eyeDistance || !options.screenDepth;
  const Imath::V2d depths = hasDefault ? depthsOf(scene) : Imath::V2d(0);
  const std::array<render::Camera, 2> eyes = render::stereoCameras(
      scene.camera, options.eyeDistance.value_or(render::defaultEyeDistance(depths)),
      options.screenDepth.value_or(render::defaultScreenDepth(depths)));
  std::vector<render::Image> pictures;
  for (int n = 0; n < 2; ++n) {
    render::Scene seen = scene;
    seen.camera = eyes[static_cast<std::size_t>(n)];
    pictures.push_back(draw(seen, n));
    // The other eye needs the memory of the layers.
    pictures.back().ids.clear();
    std::erase_if(pictures.back().channels, [](const auto& channel) {
      return channel.first != "R" && channel.first != "G" && channel.first != "B" &&
             channel.first != "A";
    });
  }
  return render::stereoPicture(pictures[0], pictures[1], options.stereo);
}

}  // namespace pipeline
