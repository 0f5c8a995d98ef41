#include "apps/pipeline/operators/pictures/volume_pictures.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/operators/volume_params.h"
#include "levelset/error.h"
#include "levelset/volumes/histogram.h"
#include "render/views/volume_light.h"

namespace pipeline {
namespace {

using levelset::UsageError;

bool hasCells(const render::VolumeSurface& surface) {
  const Imath::V3i blocks = surface.ranges().size();
  return blocks.x > 0 && blocks.y > 0 && blocks.z > 0;
}

/// Volume with the transfer function of --transfer: points, or the suggestion for the histogram.
render::DirectVolume directVolumeOf(Invocation& in, const render::Scene& scene) {
  const render::VolumeSurface& surface = *scene.solids.front().volume;
  const std::string text = in.text("transfer");
  const std::vector<render::TransferPoint> points =
      text == "auto" ? render::suggestedTransfer(levelset::histogram(surface.volume()))
                     : render::parseTransfer(text);
  if (text == "auto")
    in.notes.notes.push_back(
        fmt::format("render: --transfer \"{}\"", render::transferText(points)));
  const render::DirectVolume volume(surface, points);
  in.notes.detailsJson = Json{{"skipped_blocks", volume.skippedShare()}}.dump();
  if (volume.skippedShare() == 1 && surface.isEmpty() && hasCells(surface))
    in.notes.warnings.push_back(
        "render: the picture is empty, because no value of the volume has an opacity");
  return volume;
}

}  // namespace

bool isVolumeKind(Kind kind) {
  return kind == Kind::Volume || kind == Kind::Field;
}

void requireVolumeOptions(const Invocation& in) {
  if (isVolumeKind(in.operands[0].plan().kind)) {
    if (!in.given("isovalue") && !in.given("transfer"))
      throw UsageError(
          "render: a volume has no surface without an isovalue; give --isovalue, and see "
          "'histogram' for suggestions, or give --transfer");
    return;
  }
  for (const char* name : {"isovalue", "inside", "transfer", "no-shading"})
    if (in.given(name))
      throw UsageError(fmt::format("render: --{} is for volumes; leave it out", name));
}

render::ViewedScene volumeScene(Invocation& in) {
  const levelset::Volume volume = volumeIn(in);
  const bool hasIsovalue = in.given("isovalue");
  // No value is above the largest one, so that isosurface is empty.
  const auto surface = std::make_shared<const render::VolumeSurface>(
      volume, hasIsovalue ? in.number("isovalue") : volume.highest(),
      in.text("inside") == "below" ? render::VolumeInside::Below : render::VolumeInside::Above);
  if (!hasCells(*surface))
    in.notes.warnings.push_back(
        "render: the picture is empty, because the volume has a single layer of grid points, and "
        "no "
        "cells between them");
  else if (hasIsovalue && surface->isEmpty())
    in.notes.warnings.push_back(
        fmt::format("render: the picture is empty, because no surface of the volume has the "
                    "isovalue {}; its values lie between {:.6g} and {:.6g}",
                    in.text("isovalue"), surface->volume().lowest(), surface->volume().highest()));
  render::ViewedScene viewed;
  viewed.scene.solids.push_back({.band = {}, .volume = surface});
  return viewed;
}

void validateVolumePicture(const Invocation& in) {
  if (in.given("transfer") && in.text("transfer") != "auto")
    (void)render::TransferFunction(render::parseTransfer(in.text("transfer")), 1);
  for (const char* name : {"filter", "inside"})
    if (in.given("transfer") && !in.given("isovalue") && in.given(name))
      throw UsageError(
          fmt::format("render: --{} concerns the isosurface, and --transfer alone draws none; "
                      "leave --{} out, or give --isovalue",
                      name, name));
  if (in.flag("no-shading") && !in.given("transfer"))
    throw UsageError("render: --no-shading applies only to --transfer; leave it out");
  if (in.given("transfer") && in.flag("ground"))
    throw UsageError("render: a volume drawn with --transfer has no shadow; leave --ground out");
}

void requireSameLight(const render::Image& image, const render::Image& judged) {
  // Both have errors of about 1e-3 of the brightest light, and the kernel omits the last 1/512.
  constexpr float kTolerance = 1.0f / 128;
  for (const char* name : {"R", "G", "B", "A"}) {
    const std::vector<float>&a = image.channels.at(name), &b = judged.channels.at(name);
    const float brightest = b.empty() ? 0 : *std::max_element(b.begin(), b.end());
    for (std::size_t i = 0; i < a.size(); ++i)
      if (!(std::abs(a[i] - b[i]) <= kTolerance * std::max(1.0f, brightest)))
        throw levelset::NumericalError(fmt::format(
            "render: the light of the volume differs from that of the judge in channel {} of the "
            "pixel {},{}: {} and {}; please report it with the command",
            name, i % static_cast<std::size_t>(image.width),
            i / static_cast<std::size_t>(image.width), a[i], b[i]));
  }
}

void addLight(Invocation& in, const render::Scene& scene, const render::RenderOptions& options,
              render::Image& image, render::Image* judged) {
  const render::DirectVolume volume = directVolumeOf(in, scene);
  // The judge skips no blocks, so it takes more time.
  const double middle = judged ? 0.3 : 1;
  render::VolumeLightOptions light{.samples = options.samples,
                                   .isShaded = !in.flag("no-shading"),
                                   .isJudged = in.text("renderer") == "embree",
                                   .maxBytes = in.maxMemory,
                                   .progress = levelset::subProgress(in.progress, 0.1, middle)};
  const std::vector<render::VolumeLight> all = render::volumeLight(image, scene, volume, light);
  if (judged) {
    *judged = image;
    light.isJudged = true;
    light.progress = levelset::subProgress(in.progress, middle, 0.9);
    render::addVolumeLight(*judged, render::volumeLight(*judged, scene, volume, light));
  }
  render::addVolumeLight(image, all);
  image.attributes["ls:transfer"] = render::transferText(volume.transfer().points());
}

std::vector<Param> volumePictureParams() {
  return {
      {.name = "isovalue",
       .type = ParamType::Number,
       .doc = "for a volume: draw the surface on which the interpolated values equal this "
              "number"},
      insideParam("for a volume: side of the isovalue that is solid"),
      {.name = "transfer",
       .type = ParamType::Text,
       .doc = "for a volume: draw it by direct volume rendering. Points VALUE:OPACITY or "
              "VALUE:OPACITY/RED,GREEN,BLUE, separated by blanks; the opacity, below 1, is "
              "that of a layer one voxel thick. Or auto: from the histogram. The values between "
              "grid points are trilinear; --filter concerns the isosurface"},
      {.name = "no-shading",
       .type = ParamType::Flag,
       .doc = "with --transfer: colours do not depend on the gradient of the values"}};
}

}  // namespace pipeline
