#include "render/views/slice.h"

#include <fmt/core.h>

#include <string>
#include <tuple>
#include <vector>

#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "levelset/file_target.h"
#include "render/images/image.h"

namespace pipeline {
namespace {

using levelset::UsageError;

std::vector<std::string> slicesOf(const Invocation& in) {
  std::vector<std::string> targets;
  for (const char* name : {"png", "exr"})
    if (in.given(name)) targets.push_back(in.text(name));
  return targets;
}

void validateSlice(const Invocation& in) {
  const std::vector<Imath::V3d> plane = in.points("plane");
  if (plane.size() != 2 || !(plane[1].length() > 0))
    throw UsageError("slice: --plane needs a point and a normal, \"x,y,z x,y,z\"");
  const std::vector<std::string> targets = slicesOf(in);
  if (targets.empty())
    throw UsageError(
        "slice: no output file is named; give --png for a picture, --exr for layers, or both");
  if (targets.size() == 2 && levelset::isSameFile(targets[0], targets[1]))
    throw UsageError(fmt::format(
        "slice: '{}' is named by both --png and --exr; give two different files", targets[0]));
}

Value slice(Invocation& in) {
  const std::vector<Imath::V3d> plane = in.points("plane");
  render::SliceOptions options{
      .point = plane[0], .normal = plane[1], .maxBytes = in.maxMemory, .progress = in.progress};
  std::tie(options.width, options.height) = in.imageSize("size");
  options.step = in.length("step");
  const render::Image image = render::drawSlice(in.band(), options);
  for (const char* name : {"png", "exr"})
    if (in.given(name)) render::writeImage(in.text(name), image, name);
  return in.operands[0];
}

}  // namespace

Operator sliceOperator() {
  return {
      .name = "slice",
      .group = "Pictures",
      .summary = "draw the distance in a plane, with contour lines",
      .details =
          "The inside is blue, the outside brown. There is a contour line for each voxel of "
          "distance, or for each --step; the zero line is black. Grey tones mark points outside "
          "the band. The view direction is against the normal, with z upwards (y for a normal "
          "along z). The layers are R G B A, phi and P.X P.Y P.Z.",
      .example =
          "levelsmith torus --radius 2 --tube 0.8 --voxel 0.1 ! slice --plane \"0,0,0 "
          "1,0,0\" --png slice.png --size 320x240",
      .params = {{.name = "plane",
                  .type = ParamType::Points,
                  .doc = "a point of the plane and its normal, \"x,y,z x,y,z\"",
                  .required = true},
                 {.name = "png",
                  .type = ParamType::Path,
                  .doc = "write the coloured picture to this .png"},
                 {.name = "exr",
                  .type = ParamType::Path,
                  .doc = "write colours, distances and positions as layers to this .exr"},
                 {.name = "step",
                  .type = ParamType::Length,
                  .doc = "difference of the distance between neighbouring contour lines",
                  .fallback = "1vx",
                  .range = Range::Positive},
                 {.name = "size",
                  .type = ParamType::ImageSize,
                  .doc = "width and height of the picture, in pixels",
                  .fallback = "1024x768"}},
      .operands = {{Kind::Band, Kind::Surface}},
      .flow = Flow::PassesThrough,
      .run = slice,
      .validate = validateSlice,
      .targets = slicesOf,
      .usesStandardOutput =
          [](const Invocation& in) {
            for (const std::string& target : slicesOf(in))
              if (levelset::isStandardOutput(target)) return true;
            return false;
          },
  };
}

}  // namespace pipeline
