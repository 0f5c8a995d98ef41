#include <fmt/core.h>

#include <cmath>
#include <map>
#include <sstream>
#include <string>
#include <utility>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/operators/pictures/comparison_json.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "levelset/file_target.h"
#include "render/images/compare_images.h"
#include "render/images/image.h"

namespace pipeline {
namespace {

using levelset::UsageError;

/// Returns a JSON number, or the text "infinite", since JSON has no number for infinity.
Json numberOrText(double value) {
  return std::isfinite(value) ? Json(value) : Json("infinite");
}

Json pixelsOf(const std::vector<render::PixelDifference>& pixels) {
  Json all = Json::array();
  for (const render::PixelDifference& p : pixels)
    all.push_back({{"x", p.x}, {"y", p.y}, {"difference", numberOrText(p.value)}});
  return all;
}

}  // namespace

Json comparisonJson(const render::ImageComparison& found) {
  Json json;
  json["agrees"] = found.agrees();
  json["exact"] = found.isExact;
  json["pixels"] = found.pixels;
  json["both_hit"] = found.bothHit;
  json["unlike_at_outline"] = found.unlikeAtOutline;
  json["unlike_elsewhere"] = found.unlikeElsewhere;
  json["unlike"] = pixelsOf(found.unlike);
  json["different_bits"] = found.differentBits;
  json["only_one"] = found.onlyOne;
  json["layers"] = Json::array();
  for (const render::LayerComparison& layer : found.layers) {
    Json entry = {{"layer", layer.layer}, {"measure", layer.measure}, {"compared", layer.compared}};
    entry["median"] = numberOrText(layer.median);
    entry["p99"] = numberOrText(layer.p99);
    entry["p999"] = numberOrText(layer.p999);
    entry["largest"] = numberOrText(layer.largest);
    entry["allowed"] = {{"p999", numberOrText(layer.allowed.usual)},
                        {"largest", numberOrText(layer.allowed.worst)}};
    entry["agrees"] = layer.agrees();
    entry["worst"] = pixelsOf(layer.worst);
    json["layers"].push_back(std::move(entry));
  }
  return json;
}

namespace {

std::map<std::string, render::LayerTolerance> tolerancesOf(const Invocation& in) {
  std::map<std::string, render::LayerTolerance> all;
  if (!in.given("tolerance")) return all;
  std::istringstream words(in.text("tolerance"));
  for (std::string word; words >> word;) {
    const std::size_t equals = word.find('=');
    std::istringstream numbers(equals == std::string::npos ? "" : word.substr(equals + 1));
    render::LayerTolerance tolerance{};
    char comma = 0;
    if (!(numbers >> tolerance.usual >> comma >> tolerance.worst) || comma != ',' ||
        !numbers.eof() || !(tolerance.usual >= 0) || !(tolerance.worst >= 0))
      throw UsageError(
          fmt::format("compare-images: --tolerance '{}' is invalid; write LAYER=USUAL,WORST, as "
                      "Z=1e-6,1e-3, and separate several by blanks",
                      word));
    all[word.substr(0, equals)] = tolerance;
  }
  return all;
}

void validateComparison(const Invocation& in) {
  (void)tolerancesOf(in);
  if (in.flag("exact") && in.given("tolerance"))
    throw UsageError(
        "compare-images: --exact accepts no difference, so --tolerance has no effect; leave one of "
        "them out");
  if (in.given("difference") &&
      render::imageFormat(in.text("difference"), in.text("format")) != "exr")
    throw UsageError(
        "compare-images: --difference writes layers, which need the format EXR; name an .exr file");
  for (const char* input : {"first", "second"})
    if (in.given("difference") && levelset::isSameFile(in.text("difference"), in.text(input)))
      throw UsageError(
          fmt::format("compare-images: --difference would overwrite '{}', one of the compared "
                      "pictures; name another file",
                      in.text(input)));
}

std::string asTable(const render::ImageComparison& found) {
  std::string text = fmt::format(
      "{} pixels: {} show a surface in both pictures, {} in only one along the outline and {} "
      "elsewhere; {} differ in some bit\n",
      found.pixels, found.bothHit, found.unlikeAtOutline, found.unlikeElsewhere,
      found.differentBits);
  text += fmt::format("{:<18}{:>10}{:>10}{:>10}{:>10}  {}\n", "layer", "median", "99 %", "99.9 %",
                      "largest", "worst pixel");
  for (const render::LayerComparison& l : found.layers) {
    text += fmt::format(
        "{:<18}{:>10.2g}{:>10.2g}{:>10.2g}{:>10.2g}  {}\n", l.layer, l.median, l.p99, l.p999,
        l.largest, l.worst.empty() ? "none" : fmt::format("{},{}", l.worst[0].x, l.worst[0].y));
  }
  for (const std::string& name : found.onlyOne)
    text += fmt::format("channel {} is in one picture only\n", name);
  return text;
}

Value compareImages(Invocation& in) {
  const render::ImageComparison found =
      render::compareImages(render::readExr(in.text("first"), in.maxMemory),
                            render::readExr(in.text("second"), in.maxMemory),
                            {.exact = in.flag("exact"), .tolerances = tolerancesOf(in)});
  const Json json = comparisonJson(found);
  in.notes.detailsJson = json.dump();
  if (found.bothHit == 0)
    in.notes.warnings.push_back(
        "compare-images: no pixel shows a surface in both pictures, so no layer was compared");
  in.output = asksJson(in) ? printed(json) : asTable(found);
  if (in.given("difference"))
    render::writeImage(in.text("difference"), found.difference, in.text("format"));
  if (!found.agrees())
    throw levelset::NumericalError(fmt::format(
        "compare-images: the pictures differ: {}; look at the worst pixels, or at --difference{}",
        found.reason(),
        !found.isExact && found.coverageAgrees() ? ", or allow more with --tolerance" : ""));
  return Value(Plan{});
}

}  // namespace

Operator compareImagesOperator() {
  return {
      .name = "compare-images",
      .group = "Pictures",
      .summary = "compare two EXR pictures of one scene layer by layer",
      .details =
          "Reports percentiles of the differences and the worst pixels for each layer: Z and P "
          "relative to Z, the angle between the normals N, curvatures times the voxel size, id and "
          "colour. The exit code is 5 when the pictures differ by more than those of two correct "
          "renderers may. So they do when a pixel away from outlines shows a surface in only one "
          "picture, or when a layer exceeds its tolerance. Everything is written before that.",
      .example =
          "levelsmith sphere --radius 1 --voxel 0.1 ! render a.exr --size 64x64 --samples 1 "
          "! render b.exr --size 64x64 --samples 2 ! compare-images a.exr b.exr",
      .params = {{.name = "first",
                  .type = ParamType::Path,
                  .doc = "EXR with the layers that 'render' writes",
                  .required = true,
                  .position = 0},
                 {.name = "second",
                  .type = ParamType::Path,
                  .doc = "EXR of the same size, to compare with the first",
                  .required = true,
                  .position = 1},
                 {.name = "exact",
                  .type = ParamType::Flag,
                  .doc = "require that both pictures have the same channels with the same bits"},
                 {.name = "tolerance",
                  .type = ParamType::Text,
                  .doc = "LAYER=USUAL,WORST: largest accepted difference of a layer in 99.9 % of "
                         "the pixels, and in all pixels; separate several by blanks"},
                 {.name = "difference",
                  .type = ParamType::Path,
                  .doc = "write the differences to this .exr, with one channel for each layer"},
                 {.name = "format",
                  .type = ParamType::Text,
                  .doc = "format of the file of --difference: exr"},
                 jsonParam()},
      .flow = Flow::PassesThrough,
      .run = compareImages,
      .plan = [](Invocation&) { return Plan{}; },
      .validate = validateComparison,
      .targets =
          [](const Invocation& in) {
            return in.given("difference") ? std::vector<std::string>{in.text("difference")}
                                          : std::vector<std::string>{};
          },
      .usesStandardOutput =
          [](const Invocation& in) {
            return in.given("difference") && levelset::isStandardOutput(in.text("difference"));
          },
  };
}

}  // namespace pipeline
