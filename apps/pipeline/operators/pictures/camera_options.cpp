#include "apps/pipeline/operators/pictures/camera_options.h"

#include <fmt/core.h>

#include <algorithm>
#include <tuple>

#include "levelset/error.h"

namespace pipeline {
namespace {

using levelset::UsageError;

constexpr const char* kNames[] = {"size", "from", "to", "up", "fov", "ortho", "near", "far"};

void setDepths(Invocation& in, render::Camera& camera) {
  if (in.given("near")) camera.near = in.length("near");
  if (in.given("far")) camera.far = in.length("far");
}

/// Names of the given camera options, or of all.
void setOptions(Invocation& in, bool isAll, render::Camera& camera) {
  const auto asks = [&](const char* name) { return isAll || in.given(name); };
  if (asks("size")) std::tie(camera.width, camera.height) = in.imageSize("size");
  if (asks("up")) camera.up = in.point("up");
  if (asks("fov")) camera.verticalFov = in.radians("fov");
  if (in.given("from")) camera.from = in.point("from");
  if (in.given("to")) camera.to = in.point("to");
  if (in.given("ortho")) camera.orthoHeight = in.length("ortho");
  if (in.given("fov") && !in.given("ortho")) camera.orthoHeight.reset();
  setDepths(in, camera);
}

}  // namespace

void addCameraParams(std::vector<Param>& params) {
  const std::vector<Param> camera = {
      {.name = "size",
       .type = ParamType::ImageSize,
       .doc = "size in pixels",
       .fallback = "1024x768"},
      {.name = "from", .type = ParamType::Point, .doc = "position of the eye"},
      {.name = "to",
       .type = ParamType::Point,
       .doc = "point that the camera looks at; default: the middle of the solid"},
      {.name = "up", .type = ParamType::Point, .doc = "upward direction", .fallback = "0,1,0"},
      {.name = "fov",
       .type = ParamType::Degrees,
       .doc = "vertical field of view",
       .fallback = "35",
       .range = Range::Positive},
      {.name = "ortho",
       .type = ParamType::Length,
       .doc = "height of an orthographic view",
       .range = Range::Positive},
      {.name = "near",
       .type = ParamType::Length,
       .doc = "distance along the view axis up to which surfaces are cut off; they still cast "
              "shadows; default: 0",
       .range = Range::NonNegative},
      {.name = "far",
       .type = ParamType::Length,
       .doc = "distance beyond which surfaces are cut off; default: none",
       .range = Range::Positive}};
  params.insert(params.end(), camera.begin(), camera.end());
}

bool givesCamera(const Invocation& in) {
  return std::any_of(std::begin(kNames), std::end(kNames),
                     [&](const char* name) { return in.given(name); });
}

render::Camera cameraOf(Invocation& in, const Imath::Box3d& bounds, const render::Camera* known) {
  render::Camera camera;
  if (known) {
    camera = *known;
    setOptions(in, false, camera);
  } else if (in.given("from")) {
    camera.to = bounds.center();
    setOptions(in, true, camera);
  } else {
    const auto [width, height] = in.imageSize("size");
    camera = render::framingCamera(bounds, width, height, in.radians("fov"), in.point("up"));
    if (in.given("ortho")) camera.orthoHeight = in.length("ortho");
    setDepths(in, camera);
  }
  render::validate(camera);
  return camera;
}

void validateCamera(const Invocation& in) {
  if (in.given("to") && !in.given("from"))
    throw UsageError(fmt::format("{}: --to needs --from beside it", in.op().name));
  if (!(in.radians("fov") < 3.1))
    throw UsageError(fmt::format("{}: --fov {} degrees is too wide; it must be below 177",
                                 in.op().name, in.text("fov")));
}

}  // namespace pipeline
