#include <fmt/core.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/volume_params.h"
#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/values/terrain_picture.h"
#include "levelset/error.h"
#include "levelset/terrain/fill_heights.h"
#include "levelset/terrain/ground_slope.h"
#include "levelset/terrain/height_field.h"
#include "levelset/terrain/sculpt/ground_edits.h"
#include "render/images/grey_image.h"

namespace pipeline {
namespace {

using levelset::HeightField;
using levelset::UsageError;

Imath::V2d pairOf(Invocation& in, const std::string& name) {
  const std::vector<double> numbers = in.lengths(name);
  return {numbers.at(0), numbers.at(1)};
}

/// Sets the place of a terrain, which needs no heights.
HeightField placedTerrain(Invocation& in, HeightField terrain) {
  if (in.given("spacing")) {
    terrain.spacing = pairOf(in, "spacing");
    if (terrain.isGeographic)
      in.notes.notes.push_back(
          "--spacing is taken as lengths, the degrees of the file are dropped");
    terrain.isGeographic = false;
    terrain.coordinateSystem.clear();
  }
  if (in.given("origin")) terrain.origin = pairOf(in, "origin");
  if (in.flag("metric")) terrain = levelset::metricHeights(std::move(terrain));
  return terrain;
}

HeightField sourceOf(Invocation& in) {
  const std::optional<double> noData =
      in.given("no-data") ? std::optional(in.number("no-data")) : std::nullopt;
  if (in.operands[0].kind() == Kind::Volume)
    return levelset::heightsOf(volumeIn(in), noData, in.maxMemory);
  HeightField terrain = in.operands[0].takeTerrain(in.maxMemory);
  if (noData) {
    for (float& height : terrain.heights)
      if (height == static_cast<float>(*noData)) height = levelset::kMissingHeight;
    terrain.noData = noData;
  }
  return terrain;
}

Value makeTerrain(Invocation& in) {
  HeightField terrain = sourceOf(in);
  if (in.given("edits")) {
    const levelset::GroundEdits edits = levelset::readGroundEdits(in.text("edits"), in.maxMemory);
    levelset::withContext(in.text("edits"), [&] { levelset::applyEdits(terrain, edits); });
  }
  if (in.flag("flip")) terrain = levelset::flippedHeights(std::move(terrain));
  terrain = placedTerrain(in, std::move(terrain));
  if (in.given("crop")) terrain = levelset::croppedHeights(terrain, in.box("crop"));
  if (in.given("scale")) terrain = levelset::scaledHeights(std::move(terrain), in.number("scale"));
  levelset::requireHeights(terrain);
  if (const std::size_t missing = terrain.missingCount(); in.flag("fill") && missing > 0) {
    terrain = levelset::filledHeights(std::move(terrain),
                                      {.maxMemory = in.maxMemory, .progress = in.progress});
    in.notes.notes.push_back(fmt::format("terrain: filled {} samples", missing));
  } else if (missing > 0) {
    in.notes.notes.push_back(
        fmt::format("terrain: {} of {} samples have no data", missing, terrain.heights.size()));
  }
  return Value(std::move(terrain));
}

/// Plans the result from the size and the bounds of the operand, without its heights.
Plan planTerrain(Invocation& in) {
  const Plan& source = in.operands[0].plan();
  Plan plan{.kind = Kind::Terrain, .samples = source.samples};
  plan.fieldBytes =
      static_cast<double>(source.samples.x) * static_cast<double>(source.samples.y) * sizeof(float);
  plan.bounds = source.bounds;
  if (source.bounds.isEmpty()) return plan;
  HeightField place{.columns = std::max(1, source.samples.x),
                    .rows = std::max(1, source.samples.y)};
  place.origin = {source.bounds.min.x, source.bounds.min.y};
  const Imath::V3d size = source.bounds.size();
  place.spacing = {size.x / std::max(1, place.columns - 1), size.y / std::max(1, place.rows - 1)};
  place.isGeographic = in.flag("metric");
  place = placedTerrain(in, std::move(place));
  const Imath::V2d end = place.position(place.columns - 1, place.rows - 1);
  const double scale = in.given("scale") ? in.number("scale") : 1;
  plan.bounds = Imath::Box3d();
  plan.bounds.extendBy(Imath::V3d(place.origin.x, place.origin.y, scale * source.bounds.min.z));
  plan.bounds.extendBy(Imath::V3d(end.x, end.y, scale * source.bounds.max.z));
  if (in.given("crop")) {
    const Imath::Box3d box = in.box("crop");
    const Imath::V2i samples(place.columns, place.rows);
    for (int axis = 0; axis < 2; ++axis) {
      const auto [first, last] = levelset::samplesBetween(
          place.origin[axis], place.spacing[axis], samples[axis], box.min[axis], box.max[axis]);
      if (first > last) return plan;  // the run refuses it
      plan.samples[axis] = last - first + 1;
      plan.bounds.min[axis] = place.origin[axis] + first * place.spacing[axis];
      plan.bounds.max[axis] = place.origin[axis] + last * place.spacing[axis];
    }
    plan.fieldBytes =
        static_cast<double>(plan.samples.x) * static_cast<double>(plan.samples.y) * sizeof(float);
  }
  return plan;
}

void validateTerrain(const Invocation& in) {
  if (in.given("spacing") && in.flag("metric"))
    throw UsageError("terrain: --spacing and --metric both give the spacing; leave one out");
  if (in.given("scale") && in.number("scale") == 0)
    throw UsageError("terrain: --scale is 0; give a factor other than 0");
}

Kind kindTerrain(const Invocation&) {
  return Kind::Terrain;
}

Plan planLikeTerrain(Invocation& in) {
  Plan plan = in.operands[0].plan();
  plan.bounds.min.z = 0;
  plan.bounds.max.z = in.flag("aspect") ? 360 : 90;
  return plan;
}

Param edgesParam() {
  return {.name = "edges",
          .type = ParamType::Flag,
          .doc =
              "also for samples at the border and beside missing ones: a missing neighbour gets "
              "the height that continues the line through the sample"};
}

Value makeSlope(Invocation& in) {
  const levelset::SlopeOptions options{
      .edges = in.flag("edges"), .maxMemory = in.maxMemory, .progress = in.progress};
  HeightField terrain = in.operands[0].takeTerrain(in.maxMemory);
  return Value(in.flag("aspect") ? levelset::aspectDegrees(std::move(terrain), options)
                                 : levelset::slopeDegrees(std::move(terrain), options));
}

Value drawHillshade(Invocation& in) {
  const HeightField& terrain = in.operands[0].terrain();
  // Samples without a slope are 0.
  render::GreyPngWriter picture(in.text("file"), terrain.columns, terrain.rows, true);
  levelset::forEachShadedRow(terrain,
                             {.azimuthDegrees = in.number("azimuth"),
                              .altitudeDegrees = in.number("altitude"),
                              .exaggeration = in.number("exaggeration"),
                              .edges = in.flag("edges"),
                              .maxMemory = in.maxMemory,
                              .progress = in.progress},
                             [&](std::span<const std::uint8_t> row) { picture.add(row); });
  picture.commit();
  return in.operands[0];
}

void validateHillshade(const Invocation& in) {
  if (const double altitude = in.number("altitude"); !(altitude >= 0 && altitude <= 90))
    throw UsageError(fmt::format("hillshade: --altitude is {} degrees; give 0 to 90", altitude));
  if (!isTerrainPicture(in.text("file")))
    throw UsageError(fmt::format(
        "hillshade: '{}' is no name of a PNG; give a name that ends in .png", in.text("file")));
}

}  // namespace

Operator terrainOperator() {
  return {
      .name = "terrain",
      .group = "Terrain",
      .summary = "set spacing, heights and missing data of a terrain, or make one of a volume",
      .details =
          "Heights are along z. The options apply in this order: --no-data, --edits, --flip, "
          "--spacing, "
          "--origin, --metric, --crop, --scale, --fill. A volume of one layer, as 'read' makes of "
          "a "
          ".raw file, becomes a terrain, and its first row has the least y. Samples without data "
          "stay missing unless --fill is given. --fill makes the heights harmonic: each one is the "
          "mean of its neighbours. Known heights do not change.",
      .example =
          "levelsmith read <(printf 'ncols 3\\nnrows 3\\nxllcorner 0\\nyllcorner 0\\ncellsize "
          "1\\n0 1 0\\n1 2 1\\n0 1 0\\n') --format asc ! terrain --spacing 10,10 "
          "--scale 5 ! measure",
      .params = {{.name = "spacing",
                  .type = ParamType::Lengths,
                  .doc = "distances between samples along x and y; the origin stays",
                  .range = Range::Positive,
                  .count = 2,
                  .allowsVoxels = false},
                 {.name = "origin",
                  .type = ParamType::Lengths,
                  .doc = "position of the sample of least x and y",
                  .count = 2,
                  .allowsVoxels = false},
                 {.name = "scale",
                  .type = ParamType::Number,
                  .doc = "factor of the heights; a picture has heights from 0 to 1 without it"},
                 {.name = "metric",
                  .type = ParamType::Flag,
                  .doc =
                      "turn degrees of longitude and latitude into metres about the middle of the "
                      "terrain, on the ellipsoid of WGS 84"},
                 {.name = "crop",
                  .type = ParamType::Box,
                  .doc = "keep the samples in this box; its z is ignored"},
                 {.name = "fill",
                  .type = ParamType::Flag,
                  .doc = "give samples without data the heights of a harmonic function"},
                 {.name = "no-data",
                  .type = ParamType::Number,
                  .doc = "samples of this height have no data"},
                 {.name = "edits",
                  .type = ParamType::Path,
                  .doc = "heights that 'sculpt --edits' has changed, for the terrain before it"},
                 {.name = "flip",
                  .type = ParamType::Flag,
                  .doc = "reverse the order of the rows, for a .raw file whose first row is the "
                         "northernmost one"}},
      .operands = {{Kind::Terrain, Kind::Volume}},
      .resultKind = kindTerrain,
      .run = makeTerrain,
      .plan = planTerrain,
      .validate = validateTerrain,
  };
}

Operator slopeOperator() {
  return {
      .name = "slope",
      .group = "Terrain",
      .summary = "compute the slope of a terrain, or its aspect, in degrees",
      .details =
          "The result is a terrain whose heights are angles. Derivatives are those of Horn, from "
          "the eight neighbours of a sample, as in GDAL's gdaldem. Slope is the angle from the "
          "horizontal. Aspect is the direction in which the ground falls, clockwise from north; "
          "level samples have none. Samples at the border and beside missing ones are missing.",
      .example =
          "levelsmith read <(printf 'ncols 3\\nnrows 3\\nxllcorner 0\\nyllcorner 0\\ncellsize "
          "1\\n0 1 2\\n0 1 2\\n0 1 2\\n') --format asc ! slope --edges ! info",
      .params = {{.name = "aspect",
                  .type = ParamType::Flag,
                  .doc = "compute the aspect in place of the slope"},
                 edgesParam()},
      .operands = {{Kind::Terrain}},
      .resultKind = kindTerrain,
      .run = makeSlope,
      .plan = planLikeTerrain,
  };
}

Operator hillshadeOperator() {
  return {
      .name = "hillshade",
      .group = "Terrain",
      .summary = "draw a terrain from above in the light of the sun, one pixel for each sample",
      .details =
          "The grey value is 1 + 254 times the cosine between the normal and the light, as in "
          "GDAL's gdaldem. Samples without a slope are transparent. North is at the top. The "
          "terrain stays on the stack.",
      .example =
          "levelsmith read <(printf 'ncols 3\\nnrows 3\\nxllcorner 0\\nyllcorner 0\\ncellsize "
          "1\\n0 1 2\\n0 1 2\\n0 1 2\\n') --format asc ! hillshade shade.png --edges",
      .params = {{.name = "file",
                  .type = ParamType::Path,
                  .doc = "PNG to write",
                  .required = true,
                  .position = 0},
                 {.name = "azimuth",
                  .type = ParamType::Number,
                  .doc = "direction of the light in degrees, clockwise from north",
                  .fallback = "315"},
                 {.name = "altitude",
                  .type = ParamType::Number,
                  .doc = "height of the light above the horizon in degrees, 0 to 90",
                  .fallback = "45"},
                 {.name = "exaggeration",
                  .type = ParamType::Number,
                  .doc = "factor of the heights",
                  .fallback = "1",
                  .range = Range::Positive},
                 edgesParam()},
      .operands = {{Kind::Terrain}},
      .flow = Flow::PassesThrough,
      .run = drawHillshade,
      .validate = validateHillshade,
      .targets = [](const Invocation& in) { return std::vector{in.text("file")}; },
  };
}

}  // namespace pipeline
