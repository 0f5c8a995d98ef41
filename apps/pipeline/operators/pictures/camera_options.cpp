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

/// Changes `camera` by the camera options that are given. With `isAll`, options that are not given
/// set their defaults.
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
       .doc = "width and height of the picture, in pixels",
       .fallback = "1024x768"},
      {.name = "from",
       .type = ParamType::Point,
       .doc = "position of the eye; default: a three-quarter view of the solid, or the view of the "
              "scene"},
      {.name = "to",
       .type = ParamType::Point,
       .doc = "point that the camera looks at; default: the middle of the solid"},
      {.name = "up",
       .type = ParamType::Point,
       .doc = "direction in space that points upwards in the picture",
       .fallback = "0,1,0"},
      {.name = "fov",
       .type = ParamType::Degrees,
       .doc = "vertical angle of view",
       .fallback = "35",
       .range = Range::Positive},
      {.name = "ortho",
       .type = ParamType::Length,
       .doc = "draw an orthographic view of this height, in place of a perspective view",
       .range = Range::Positive},
      {.name = "near",
       .type = ParamType::Length,
       .doc = "distance from the eye along the view axis; surfaces nearer than this are not drawn, "
              "but cast shadows; default: 0",
       .range = Range::NonNegative},
      {.name = "far",
       .type = ParamType::Length,
       .doc = "distance from the eye along the view axis; surfaces farther than this are not "
              "drawn; default: no limit",
       .range = Range::Positive}};
  params.insert(params.end(), camera.begin(), camera.end());
}

bool givesCamera(const Invocation& in) {
  return std::any_of(std::begin(kNames), std::end(kNames),
                     [&](const char* name) { return in.given(name); });
}

render::Camera cameraOf(Invocation& in, const Imath::Box3d& bounds, const render::Camera* known,
                        const render::Scene* drawn) {
  render::Camera camera;
  if (known) {
    camera = *known;
    setOptions(in, false, camera);
  } else if (in.given("from")) {
    camera.to = bounds.center();
    setOptions(in, true, camera);
  } else {
    const auto [width, height] = in.imageSize("size");
    const double fov = in.radians("fov");
    const Imath::V3d up = in.point("up");
    camera = drawn ? render::framingCamera(*drawn, width, height, fov, up)
                   : render::framingCamera(bounds, width, height, fov, up);
    if (in.given("ortho")) camera.orthoHeight = in.length("ortho");
    setDepths(in, camera);
  }
  render::validate(camera);
  return camera;
}

void validateCamera(const Invocation& in) {
  if (in.given("to") && !in.given("from"))
    throw UsageError(
        fmt::format("{}: --to needs the position of the eye, too; give --from", in.op().name));
  if (!(in.radians("fov") < 3.1))
    throw UsageError(fmt::format("{}: --fov {} degrees is too wide; give less than 177",
                                 in.op().name, in.text("fov")));
}

}  // namespace pipeline
