#include "mapping/placement/scatter.h"

#include <fmt/core.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/fields.h"
#include "apps/pipeline/operators/mapping/patch_options.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "levelset/fields/expression.h"
#include "mapping/placement/make_patch.h"

namespace pipeline {
namespace {

using levelset::UsageError;

void validateScatter(const Invocation& in) {
  if (in.given("count") == in.given("distance"))
    throw UsageError("scatter: give either --count or --distance");
  if (in.integer("seed") < 0)
    throw UsageError(
        fmt::format("scatter: --seed {} is negative; give 0 or more", in.integer("seed")));
  if (in.given("density") && !in.text("density").starts_with('@')) {
    const levelset::NormalSpeed density = levelset::speedExpression(in.text("density"));
    if (density.usesTime || density.usesCurvature)
      throw UsageError(
          fmt::format("scatter: --density '{}' depends on {}; use x, y, z, r and the normal nx, "
                      "ny, nz",
                      in.text("density"), density.usesTime ? "the time t" : "the curvature k"));
  }
  validateLayers(in);
}

/// Returns the density of positions as a function of place and normal.
mapping::SurfaceShare densityOf(const Invocation& in) {
  const levelset::NormalSpeed density = normalSpeed(in, "density");
  return [value = density.value](const Imath::V3d& position, const Imath::V3d& normal) {
    return value({.position = position, .normal = normal});
  };
}

mapping::ScatterOptions scatterOptions(Invocation& in) {
  mapping::ScatterOptions options;
  if (in.given("count")) {
    options.density.count = static_cast<std::size_t>(in.integer("count"));
  } else {
    options.density.distance = in.length("distance");
  }
  if (in.given("scale")) options.density.scale = scalarField(in, "scale");
  if (const std::optional<levelset::Mask> mask = maskOf(in))
    options.density.weight = [mask = *mask](const Imath::V3d& p) { return mask.weight(p); };
  if (in.given("density")) options.density.share = densityOf(in);
  options.density.seed = static_cast<std::uint64_t>(in.integer("seed"));
  options.density.progress = in.progress;
  options.density.maxMemory = in.maxMemory;
  const std::array<double, 2> size = patchSizeOf(in);
  options.uSize = size[0];
  options.vSize = size[1];
  if (in.given("along")) options.direction = vectorField(in, "along");
  options.rotation = in.radians("rotate");
  options.jitter = in.radians("jitter");
  options.patch = patchOptionsOf(in);
  options.patch.progress = {};
  options.allowFolds = in.flag("allow-folds");
  return options;
}

/// Returns the recipe of scattered patches: each patch is rebuilt separately, at its scale.
std::shared_ptr<const PatchRecipe> recipeOf(const Invocation& in,
                                            const std::vector<mapping::PatchSite>& sites,
                                            const mapping::PatchOptions& options) {
  PatchRecipe recipe;
  tellOrigin(in, recipe);
  recipe.outlines = outlinesOf;
  recipe.make = [sites, options](const levelset::NarrowBand& base,
                                 std::span<const mapping::Footprint> footprints,
                                 std::span<const mapping::Footprint>,
                                 const levelset::Progress& progress) {
    std::vector<mapping::Patch> patches;
    for (std::size_t i = 0; i < footprints.size(); ++i) {
      mapping::PatchOptions now = options;
      now.spacing *= sites[i].scale;
      now.mirror = true;
      levelset::report(progress, static_cast<double>(i) / static_cast<double>(footprints.size()));
      patches.push_back(
          mapping::makePatch(base, footprints[i].corners, footprints[i].height, now).patch);
    }
    return patches;
  };
  return std::make_shared<const PatchRecipe>(std::move(recipe));
}

Value scatter(Invocation& in) {
  const mapping::ScatterOptions options = scatterOptions(in);
  const bool isAuto = in.text("height") == "auto";
  const double height = isAuto ? in.band().voxelSize() : in.length("height");
  mapping::ScatterResult result = mapping::scatter(in.band(), height, options);
  nlohmann::ordered_json json;
  json["patches"] = result.patches.size();
  json["left_out"] = result.leftOut;
  if (std::isfinite(result.distance)) json["least_distance"] = result.distance;
  in.notes.detailsJson = json.dump();
  in.notes.notes.push_back(fmt::format(
      "{} patches{}", result.patches.size(),
      std::isfinite(result.distance) ? fmt::format(", {:.4g} or more apart{}", result.distance,
                                                   in.given("scale") ? " at scale 1" : "")
                                     : ""));
  if (options.density.count > result.patches.size()) {
    in.notes.warnings.push_back(
        fmt::format("scatter: {} of {} patches could not be placed; the first reason: {}",
                    options.density.count - result.patches.size(), options.density.count,
                    result.leftOut > 0 ? result.cause
                                       : "mask and density leave too small a part of "
                                         "the surface"));
  } else if (result.leftOut > 0) {
    in.notes.notes.push_back(
        fmt::format("no patch could be built at {} positions; the first reason: {}", result.leftOut,
                    result.cause));
  }
  PatchValue value;
  value.patches = std::move(result.patches);
  value.recipe = recipeOf(in, result.sites, options.patch);
  if (isAuto) {
    value.atHeight = [base = in.band(), sites = std::move(result.sites), patch = options.patch](
                         double h, const levelset::Progress& progress) {
      mapping::PatchOptions now = patch;
      now.progress = progress;
      return mapping::makePatches(base, sites, h, now);
    };
  }
  return Value(std::move(value));
}

Plan planScatter(Invocation& in) {
  Plan plan = in.operands[0].plan();
  plan.kind = Kind::Patch;
  const std::vector<double> size = in.lengths("size");
  const bool isAuto = in.text("height") == "auto";
  plan.patchSize = {size[0], size[1], isAuto ? 0 : in.length("height")};
  // Discs placed at random in a plane until no more fit cover about 0.7 times the area that the
  // densest packing covers. That packing has one disc per 0.866 × distance².
  constexpr double kPacked = 0.7 / 0.866;
  const double distance = in.given("distance") ? in.length("distance") : 0;
  plan.patchCount = in.given("count") ? static_cast<double>(in.integer("count"))
                                      : std::max(1.0, kPacked * plan.area / (distance * distance));
  const double height = isAuto ? std::hypot(size[0], size[1]) : plan.patchSize.z;
  plan.bounds.min -= Imath::V3d(height);
  plan.bounds.max += Imath::V3d(height);
  plan.area = 0;
  return plan;
}

}  // namespace

Operator scatterOperator() {
  return {
      .name = "scatter",
      .group = "Texture mapping",
      .summary = "scatter patches over a surface, evenly and at random",
      .details =
          "The centres are Poisson-disc samples of the surface. --scale varies the size of patches "
          "and their distances over the surface, --along turns u, a mask or --density thins the "
          "patches out. "
          "There is no patch where the surface is too curved for one, or where the patch would "
          "fold.",
      .example =
          "levelsmith sphere --radius 10 --voxel 0.5 --as ball ! scatter @ball --count 12 "
          "--size 4,4 --height 1.5 --layers 2 --as many ! torus --radius 2 --tube 0.6 "
          "--voxel 0.3 --as ring ! texture @ball @ring @many --voxel 0.5 ! write studded.vdb",
      .params = withMask(
          withLayers({{.name = "count",
                       .type = ParamType::Integer,
                       .doc = "number of patches",
                       .range = Range::Positive},
                      {.name = "distance",
                       .type = ParamType::Length,
                       .doc = "least distance between the centres of patches, along the surface; "
                              "places as many patches as fit",
                       .range = Range::Positive},
                      {.name = "size",
                       .type = ParamType::Lengths,
                       .doc = "lengths of a patch along u and along v, measured on the surface",
                       .range = Range::Positive,
                       .required = true,
                       .count = 2},
                      {.name = "scale",
                       .type = ParamType::Scalar,
                       .doc = "field that scales the size, height and distance of the patches at "
                              "each point; default: 1"},
                      {.name = "density",
                       .type = ParamType::Speed,
                       .doc = "share of the positions, from 0 to 1, that is kept at each point: a "
                              "formula in x, y, z, r and the outward normal nx, ny, nz, or a "
                              "field; acos(nz) is the slope of a terrain, in radians"},
                      {.name = "along",
                       .type = ParamType::Velocity,
                       .doc = "vector field for the direction of u of each patch; only its "
                              "tangential part is used"},
                      {.name = "rotate",
                       .type = ParamType::Degrees,
                       .doc = "rotation of the direction u about the surface normal",
                       .fallback = "0"},
                      {.name = "jitter",
                       .type = ParamType::Degrees,
                       .doc = "largest random rotation of a patch about the normal, to either "
                              "side; 180 allows all directions",
                       .fallback = "0"},
                      {.name = "seed",
                       .type = ParamType::Integer,
                       .doc = "seed of the random positions",
                       .fallback = "1"},
                      {.name = "allow-folds",
                       .type = ParamType::Flag,
                       .doc = "keep patches that fold, in place of leaving them out"}})),
      .operands = {{Kind::Band, Kind::Surface}},
      .resultKind = [](const Invocation&) { return Kind::Patch; },
      .run = scatter,
      .plan = planScatter,
      .validate = validateScatter,
  };
}

}  // namespace pipeline
