#include <fmt/core.h>

#include "apps/pipeline/invocation.h"
#include "levelset/error.h"
#include "levelset/file_target.h"
#include "render/camera.h"
#include "render/embree/embree_renderer.h"
#include "render/image.h"
#include "render/scene.h"

namespace pipeline {
namespace {

using levelset::UsageError;

render::Camera cameraOf(Invocation& in) {
  const auto [width, height] = in.imageSize("size");
  const double fov = in.radians("fov");
  render::Camera camera;
  if (in.given("from")) {
    camera.from = in.point("from");
    camera.to = in.given("to") ? in.point("to") : in.operands[0].plan().bounds.center();
    camera.width = width;
    camera.height = height;
    camera.verticalFov = fov;
    camera.up = in.point("up");
  } else {
    camera =
        render::framingCamera(in.operands[0].plan().bounds, width, height, fov, in.point("up"));
  }
  if (in.given("ortho")) camera.orthoHeight = in.length("ortho");
  render::validate(camera);
  return camera;
}

constexpr long kMostSamples = 4096;

void validateDraw(const Invocation& in) {
  if (in.given("to") && !in.given("from")) throw UsageError("render: --to needs --from beside it");
  if (!(in.radians("fov") < 3.1))
    throw UsageError(
        fmt::format("render: --fov {} degrees is too wide; it must be below 177", in.text("fov")));
  if (in.integer("samples") > kMostSamples)
    throw UsageError(fmt::format("render: --samples {} is too many; {} are the most",
                                 in.text("samples"), kMostSamples));
  if (render::imageFormat(in.text("file"), in.text("format")).empty()) {
    throw UsageError(
        fmt::format("render: '{}' is of no known format; use .exr or .png, or --format",
                    in.text(in.given("format") ? "format" : "file")));
  }
  if (!in.given("png")) return;
  const std::string file = in.text("file"), png = in.text("png");
  if (levelset::isStandardOutput(file) && levelset::isStandardOutput(png))
    throw UsageError("render: two images cannot share standard output; use a file for one");
  if (levelset::isSameFile(file, png))
    throw UsageError(fmt::format(
        "render: '{}' is named twice, for the image and for --png; name two files", file));
}

std::vector<std::string> targetsOf(const Invocation& in) {
  std::vector<std::string> targets{in.text("file")};
  if (in.given("png")) targets.push_back(in.text("png"));
  return targets;
}

Value draw(Invocation& in) {
  render::Scene scene;
  scene.camera = cameraOf(in);
  scene.solids.push_back({.band = in.band()});
  const render::Image image =
      render::renderEmbree(scene, {.samples = static_cast<int>(in.integer("samples")),
                                   .maxBytes = in.maxMemory,
                                   .progress = in.progress});
  render::writeImage(in.text("file"), image, in.text("format"));
  if (in.given("png")) render::writeImage(in.text("png"), image, "png");
  return in.operands[0];
}

Plan planDraw(Invocation& in) {
  (void)cameraOf(in);
  return in.operands[0].plan();
}

}  // namespace

void addPictureOperators(std::vector<Operator>& all) {
  all.push_back({
      .name = "render",
      .group = "Pictures",
      .summary = "draw a level set to an EXR with all layers, or a PNG",
      .details = "Layers of the EXR: R G B A, Z (along the view axis, +inf for a miss), N.X N.Y "
                 "N.Z, P.X P.Y P.Z, "
                 "curvature.mean .gauss .k1 .k2, id. Without --from, a three-quarter view that "
                 "frames the solid.",
      .example = "levelsmith torus --radius 2 --tube 0.8 --voxel 0.05 ! render torus.png --size "
                 "320x240 --from 5,4,6 --to 0,0,0",
      .params =
          {{.name = "file",
            .type = ParamType::Path,
            .doc = ".exr or .png, or -",
            .required = true,
            .position = 0},
           {.name = "png", .type = ParamType::Path, .doc = "write the colours to this .png too"},
           {.name = "renderer",
            .type = ParamType::Choice,
            .doc = "which one draws",
            .fallback = "embree",
            .choices = {"embree"}},
           {.name = "size", .type = ParamType::ImageSize, .doc = "pixels", .fallback = "1024x768"},
           {.name = "from", .type = ParamType::Point, .doc = "where the eye is"},
           {.name = "to",
            .type = ParamType::Point,
            .doc = "where it looks; default: the middle of the solid"},
           {.name = "up", .type = ParamType::Point, .doc = "what is up", .fallback = "0,1,0"},
           {.name = "fov",
            .type = ParamType::Degrees,
            .doc = "vertical field of view",
            .fallback = "35",
            .range = Range::Positive},
           {.name = "ortho",
            .type = ParamType::Length,
            .doc = "orthographic; height of the view",
            .range = Range::Positive},
           {.name = "samples",
            .type = ParamType::Integer,
            .doc = "of colour per pixel",
            .fallback = "4",
            .range = Range::Positive},
           {.name = "format", .type = ParamType::Text, .doc = "exr or png; default: by extension"}},
      .operands = {{Kind::Band}},
      .flow = Flow::PassesThrough,
      .run = draw,
      .plan = planDraw,
      .validate = validateDraw,
      .targets = targetsOf,
      .usesStandardOutput =
          [](const Invocation& in) {
            return levelset::isStandardOutput(in.text("file")) ||
                   (in.given("png") && levelset::isStandardOutput(in.text("png")));
          },
  });
}

}  // namespace pipeline
