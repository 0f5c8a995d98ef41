#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "levelset/file_target.h"
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

/// Sum of the weights at a point of a long straight stroke, over the dabs along it.
double strokeWeight() {
  double sum = 0;
  for (int k = -3; k <= 3; ++k) {
    const double share = 1 - k * k * kDabDistance * kDabDistance;
    sum += share * share;
  }
  return sum;
}

/// The points, or places along the line through them at equal distances. The last point is always
/// among them.
std::vector<Imath::V3d> dabPlaces(Invocation& in, double radius) {
  const std::vector<Imath::V3d> points = in.points("at");
  if (!in.flag("stroke")) return points;
  if (std::all_of(points.begin(), points.end(), [&](const Imath::V3d& p) {
        return p.x == points.front().x && p.y == points.front().y;
      }))
    throw UsageError(
        "sculpt: --stroke needs a line through at least two positions; give another one to --at, "
        "or leave --stroke out");
  const double distance = kDabDistance * radius;
  std::vector<Imath::V3d> places = {points.front()};
  double toNext = distance;  // along the line, from the begin of the segment
  for (std::size_t n = 1; n < points.size(); ++n) {
    const Imath::V3d step = points[n] - points[n - 1];
    const double length = std::hypot(step.x, step.y);
    if (!(length / distance + static_cast<double>(places.size()) <= kMostDabs))
      throw UsageError(fmt::format(
          "sculpt: the line needs more than {:.0f} dabs; give a larger --radius", kMostDabs));
    for (; toNext <= length; toNext += distance)
      places.push_back(points[n - 1] + step * (toNext / length));
    toNext -= length;
  }
  // Rounding may leave the last point out.
  const Imath::V3d rest = points.back() - places.back();
  if (std::hypot(rest.x, rest.y) > 1e-9 * distance)
    places.push_back(points.back());
  else
    places.back() = points.back();
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
  const bool isSum = dab.effect == BrushEffect::Raise || dab.effect == BrushEffect::Noise;
  if (in.flag("stroke") && isSum) dab.strength /= strokeWeight();
  levelset::requireLengths(in.operands[0].terrain());
  HeightField terrain = in.operands[0].takeTerrain(in.maxMemory);
  std::optional<levelset::GroundChanges> changes;
  if (in.given("edits")) changes.emplace(terrain);
  std::size_t beside = 0;
  for (std::size_t n = 0; n < places.size(); ++n) {
    dab.center = {places[n].x, places[n].y};
    if (in.given("level"))
      dab.level = in.number("level");
    else if (in.flag("to-points"))
      dab.level = places[n].z;
    const levelset::SampleRange range = levelset::applyDab(terrain, dab, in.maxMemory);
    beside += range.isEmpty();
    if (changes) changes->add(range);
    levelset::report(in.progress, static_cast<double>(n + 1) / static_cast<double>(places.size()));
  }
  if (beside == places.size())
    in.notes.warnings.push_back(
        "sculpt: no sample is below the brush, so nothing changes; give other positions, or a "
        "larger "
        "--radius");
  in.notes.detailsJson = Json{{"dabs", places.size()}, {"dabs_beside", beside}}.dump();
  if (changes) levelset::writeGroundEdits(in.text("edits"), changes->edits(terrain, in.maxMemory));
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
                      "move the brush along the line through the positions; raise and noise change "
                      "the middle of a straight line by the strength, and its ends by half of it"},
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
            if (plan.bounds.isEmpty()) return plan;
            const std::string brush = in.text("brush");
            const std::vector<Imath::V3d> points = in.points("at");
            const auto include = [&](double z) {
              plan.bounds.min.z = std::min(plan.bounds.min.z, z);
              plan.bounds.max.z = std::max(plan.bounds.max.z, z);
            };
            if (brush == "raise" || brush == "noise") {
              // Dabs at one position add up.
              const double most = std::abs(in.number("strength")) * (in.flag("stroke") ? 2 : 1) *
                                  static_cast<double>(points.size());
              plan.bounds.min.z -= most;
              plan.bounds.max.z += most;
            }
            if (in.given("level")) include(in.number("level"));
            if (in.flag("to-points"))
              for (const Imath::V3d& p : points) include(p.z);
            return plan;
          },
      .validate = validateSculpt,
      .targets =
          [](const Invocation& in) {
            return in.given("edits") ? std::vector{in.text("edits")} : std::vector<std::string>();
          },
      .usesStandardOutput =
          [](const Invocation& in) {
            return in.given("edits") && levelset::isStandardOutput(in.text("edits"));
          },
  };
}

}  // namespace pipeline
