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
#include "render/direct/direct_volume.h"

namespace pipeline {
namespace {

using levelset::UsageError;

bool hasCells(const render::VolumeSurface& surface) {
  const Imath::V3i blocks = surface.ranges().size();
  return blocks.x > 0 && blocks.y > 0 && blocks.z > 0;
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

render::Filter filterOf(const Invocation& in) {
  for (const render::Filter filter : render::kFilters)
    if (in.text("filter") == render::filterName(filter)) return filter;
  return render::Filter::Trilinear;
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
  else if (hasIsovalue && surface->isEmpty(filterOf(in)))
    in.notes.warnings.push_back(
        fmt::format("render: the picture is empty, because no surface of the volume has the "
                    "isovalue {}; its values lie between {:.6g} and {:.6g}",
                    in.text("isovalue"), surface->volume().lowest(), surface->volume().highest()));
  else if (hasIsovalue && surface->isEmpty())
    in.notes.warnings.push_back(fmt::format(
        "render: the isovalue {} lies outside the samples of the volume, from {:.6g} to "
        "{:.6g}; the picture shows only where the filter {} goes beyond them",
        in.text("isovalue"), surface->volume().lowest(), surface->volume().highest(),
        in.text("filter")));
  render::ViewedScene viewed;
  if (hasIsovalue) viewed.scene.solids.push_back({.band = {}, .volume = surface});
  if (in.given("transfer")) {
    viewed.scene.volumePart = volumePartOf(in, *surface);
    if (viewed.scene.volumePart->volume.skippedShare() == 1 && surface->isEmpty() &&
        hasCells(*surface))
      in.notes.warnings.push_back(
          "render: the picture is empty, because no value of the volume has an opacity");
  }
  return viewed;
}

render::VolumePart volumePartOf(Invocation& in, const render::VolumeSurface& surface) {
  const std::string text = in.text("transfer");
  const std::vector<render::TransferPoint> points =
      text == "auto" ? render::suggestedTransfer(levelset::histogram(surface.volume()))
                     : render::parseTransfer(text);
  if (text == "auto")
    in.notes.notes.push_back(
        fmt::format("{}: --transfer \"{}\"", in.op().name, render::transferText(points)));
  render::VolumePart part{render::DirectVolume(surface, points), !in.flag("no-shading")};
  in.notes.detailsJson = Json{{"skipped_blocks", part.volume.skippedShare()}}.dump();
  return part;
}

void validateTransfer(const Invocation& in) {
  if (in.given("transfer") && in.text("transfer") != "auto")
    (void)render::TransferFunction(render::parseTransfer(in.text("transfer")), 1);
  if (in.flag("no-shading") && !in.given("transfer"))
    throw UsageError(
        fmt::format("{}: --no-shading applies only to --transfer; leave it out", in.op().name));
}

void validateVolumePicture(const Invocation& in) {
  validateTransfer(in);
  for (const char* name : {"filter", "inside", "directions", "along"})
    if (in.given("transfer") && !in.given("isovalue") && in.given(name))
      throw UsageError(
          fmt::format("render: --{} concerns the isosurface, and --transfer alone draws none; "
                      "leave --{} out, or give --isovalue",
                      name, name));
  if (in.given("transfer") && in.flag("ground") && !in.isAssumed("ground"))
    throw UsageError("render: a volume with a transfer function has no shadow; leave --ground out");
}

std::vector<Param> transferParams() {
  return {
      {.name = "transfer",
       .type = ParamType::Text,
       .doc = "for a volume: draw it by direct volume rendering. Points VALUE:OPACITY or "
              "VALUE:OPACITY/RED,GREEN,BLUE, separated by blanks; the opacity, below 1, is "
              "that of a layer one voxel thick. Or auto: from the histogram. The values between "
              "grid points are trilinear; --filter of render concerns surfaces"},
      {.name = "no-shading",
       .type = ParamType::Flag,
       .doc = "with --transfer: colours do not depend on the gradient of the values"}};
}

std::vector<Param> volumePictureParams() {
  std::vector<Param> params = {
      {.name = "isovalue",
       .type = ParamType::Number,
       .doc = "for a volume: draw the surface on which the interpolated values equal this "
              "number"},
      insideParam("for a volume: side of the isovalue that is solid")};
  for (const Param& param : transferParams()) params.push_back(param);
  return params;
}

}  // namespace pipeline
