#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "levelset/terrain/sculpt/sculpted_ground.h"

namespace pipeline {
namespace {

using levelset::BrushDab;
using levelset::BrushEffect;
using levelset::HeightField;
using levelset::UsageError;

/// Dabs along a line are this share of the radius apart.
constexpr double kDabDistance = 0.25;
constexpr double kMostDabs = 1e6;

BrushEffect effectOf(const std::string& brush) {
  if (brush == "raise") return BrushEffect::Raise;
  if (brush == "flatten") return BrushEffect::Flatten;
  if (brush == "smooth") return BrushEffect::Smooth;
  if (brush == "noise") return BrushEffect::Noise;
  return BrushEffect::Erode;
}

/// The line through the points, or the points alone.
std::vector<Imath::V3d> dabPlaces(Invocation& in, double radius) {
  const std::vector<Imath::V3d> points = in.points("at");
  if (!in.flag("stroke")) return points;
  std::vector<Imath::V3d> places = {points.front()};
  for (std::size_t n = 1; n < points.size(); ++n) {
    const Imath::V3d step = points[n] - points[n - 1];
    const double count = std::ceil(std::hypot(step.x, step.y) / (kDabDistance * radius));
    if (!(count + static_cast<double>(places.size()) <= kMostDabs))
      throw UsageError(fmt::format(
          "sculpt: the line needs more than {:.0f} dabs; give a larger --radius", kMostDabs));
    for (int k = 1; k < count; ++k) places.push_back(points[n - 1] + step * (k / count));
    places.push_back(points[n]);
  }
  return places;
}

Value sculpt(Invocation& in) {
  BrushDab dab{.effect = effectOf(in.text("brush")),
               .radius = in.length("radius"),
               .strength = in.number("strength"),
               .passes = in.integerAs<int>("passes"),
               .seed = in.integerAs<std::uint32_t>("seed")};
  if (in.given("wavelength")) dab.wavelength = in.length("wavelength");
  dab.talusDegrees = in.number("talus");
  const std::vector<Imath::V3d> places = dabPlaces(in, dab.radius);
  HeightField terrain = in.operands[0].terrain();
  levelset::GroundChanges changes(terrain);
  std::size_t beside = 0;
  for (std::size_t n = 0; n < places.size(); ++n) {
    dab.center = {places[n].x, places[n].y};
    if (in.given("level"))
      dab.level = in.number("level");
    else if (in.flag("to-points"))
      dab.level = places[n].z;
    const levelset::SampleRange range = levelset::applyDab(terrain, dab, in.maxMemory);
    beside += range.isEmpty();
    changes.add(range);
    levelset::report(in.progress, static_cast<double>(n + 1) / static_cast<double>(places.size()));
  }
  if (beside == places.size())
    in.notes.warnings.push_back(
        "sculpt: the brush is beside the terrain and changes nothing; give other positions");
  in.notes.detailsJson = Json{{"dabs", places.size()}, {"dabs_beside", beside}}.dump();
  if (in.given("edits")) levelset::writeGroundEdits(in.text("edits"), changes.edits(terrain));
  return Value(std::move(terrain));
}

void validateSculpt(const Invocation& in) {
  const std::string brush = in.text("brush");
  const auto only = [&](const char* option, std::initializer_list<const char*> brushes) {
    if (!in.given(option) || std::find(brushes.begin(), brushes.end(), brush) != brushes.end())
      return;
    throw UsageError(
        fmt::format("sculpt: --{} has no meaning for --brush {}; leave it out", option, brush));
  };
  only("level", {"flatten"});
  only("to-points", {"flatten"});
  only("wavelength", {"noise"});
  only("seed", {"noise"});
  only("talus", {"erode"});
  only("passes", {"smooth", "erode"});
  if (in.given("level") && in.flag("to-points"))
    throw UsageError("sculpt: --level and --to-points both give the height; leave one out");
  const bool isShare = brush != "raise" && brush != "noise";
  const double strength = in.number("strength");
  if (isShare && !(strength >= 0 && strength <= 1))
    throw UsageError(fmt::format("sculpt: --strength of --brush {} is {}; give a share from 0 to 1",
                                 brush, strength));
  if (const double talus = in.number("talus"); !(talus >= 0 && talus < 90))
    throw UsageError(fmt::format("sculpt: --talus is {}; give 0 to below 90 degrees", talus));
  if (const long passes = in.integer("passes"); passes < 1 || passes > 1000)
    throw UsageError(fmt::format("sculpt: --passes is {}; give 1 to 1000", passes));
  if (in.points("at").empty()) throw UsageError("sculpt: --at has no position; give one");
}

}  // namespace

Operator sculptOperator() {
  return {
      .name = "sculpt",
      .group = "Terrain",
      .summary = "change the heights of a terrain with a round brush",
      .details =
          "The weight of a sample at the distance r from the brush is (1 − r²/R²)². raise adds "
          "strength × weight, also a negative one. flatten moves heights by that share towards a "
          "height. smooth diffuses heights and keeps planes. noise adds gradient noise. erode "
          "moves "
          "ground down slopes steeper than the talus, and keeps the volume. Samples without data "
          "stay missing. --edits writes the changes to a file beside the data, and "
          "'terrain --edits' applies them to it.",
      .example =
          "levelsmith read <(printf 'ncols 3\\nnrows 3\\nxllcenter 0\\nyllcenter 0\\ncellsize "
          "1\\n0 0 0\\n0 0 0\\n0 0 0\\n') --format asc ! sculpt --brush raise --at 1,1,0 "
          "--radius 2 --strength 5 ! info",
      .params = {{.name = "brush",
                  .type = ParamType::Choice,
                  .doc = "what the brush does",
                  .choices = {"raise", "flatten", "smooth", "noise", "erode"},
                  .required = true},
                 {.name = "at",
                  .type = ParamType::Points,
                  .doc = "positions of the brush \"x,y,z …\"; z only counts with --to-points",
                  .required = true},
                 {.name = "stroke",
                  .type = ParamType::Flag,
                  .doc =
                      "move the brush along the line through the positions, in steps of a quarter "
                      "of the radius"},
                 {.name = "radius",
                  .type = ParamType::Length,
                  .doc = "radius R of the brush",
                  .range = Range::Positive,
                  .required = true,
                  .allowsVoxels = false},
                 {.name = "strength",
                  .type = ParamType::Number,
                  .doc = "raise and noise: height in world units; other brushes: share from 0 to 1",
                  .required = true},
                 {.name = "level",
                  .type = ParamType::Number,
                  .doc = "with flatten: height; default: the weighted mean below each dab"},
                 {.name = "to-points",
                  .type = ParamType::Flag,
                  .doc = "with flatten: the height is the z of the positions, as for a road"},
                 {.name = "wavelength",
                  .type = ParamType::Length,
                  .doc = "with noise: size of its features; default: a quarter of the radius",
                  .range = Range::Positive,
                  .allowsVoxels = false},
                 {.name = "seed",
                  .type = ParamType::Integer,
                  .doc = "with noise: number of the pattern",
                  .fallback = "0",
                  .range = Range::NonNegative},
                 {.name = "talus",
                  .type = ParamType::Number,
                  .doc = "with erode: steepest slope that stays, degrees",
                  .fallback = "33"},
                 {.name = "passes",
                  .type = ParamType::Integer,
                  .doc = "with smooth and erode: number of steps, 1 to 1000",
                  .fallback = "8"},
                 {.name = "edits",
                  .type = ParamType::Path,
                  .doc = "also write the changed heights to this .edits file"}},
      .operands = {{Kind::Terrain}},
      .resultKind = [](const Invocation&) { return Kind::Terrain; },
      .run = sculpt,
      .plan =
          [](Invocation& in) {
            Plan plan = in.operands[0].plan();
            // Raised ground leaves the old heights.
            const double most = std::abs(in.number("strength"));
            if (!plan.bounds.isEmpty()) {
              plan.bounds.min.z -= most;
              plan.bounds.max.z += most;
            }
            return plan;
          },
      .validate = validateSculpt,
      .targets =
          [](const Invocation& in) {
            return in.given("edits") ? std::vector{in.text("edits")} : std::vector<std::string>();
          },
  };
}

}  // namespace pipeline
