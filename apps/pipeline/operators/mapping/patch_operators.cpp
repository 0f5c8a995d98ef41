#include <fmt/core.h>

#include <array>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/mapping/patch_options.h"
#include "apps/pipeline/operators/mapping/patch_plans.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "mapping/placement/decal.h"
#include "mapping/placement/make_patch.h"
#include "mapping/placement/patch_grid.h"

namespace pipeline {
namespace {

using Imath::V3d;
using levelset::UsageError;

constexpr std::array<const char*, 4> kSides = {"side0", "side1", "side2", "side3"};

/// Checks --corners, or --at and --size, and the options that fit only corners or only a centre.
/// @throws levelset::UsageError for a wrong combination
void validateOutline(const Invocation& in) {
  const std::string& name = in.op().name;
  if (in.given("at") && !in.given("size")) throw UsageError(name + ": --at needs --size a,b, too");
  if (in.given("corners")) {
    if (in.given("size") || in.given("rotate"))
      throw UsageError(name +
                       ": --size and --rotate need --at and cannot be combined with --corners");
    const std::size_t count = in.points("corners").size();
    if (count != 4)
      throw UsageError(fmt::format("{}: --corners needs four points, not {}", name, count));
  }
  for (const char* side : kSides) {
    if (in.given(side) && !in.given("corners"))
      throw UsageError(fmt::format("{}: --{} needs --corners", name, side));
  }
}

void validatePatch(const Invocation& in) {
  if (in.given("corners") == in.given("at"))
    throw UsageError("patch: give either --corners \"p0 p1 p2 p3\" or --at p --size a,b");
  validateOutline(in);
  validateLayers(in);
}

void validateGrid(const Invocation& in) {
  const int ways = in.given("corners") + in.given("at") + in.given("around");
  if (ways != 1) {
    throw UsageError(
        "patch-grid: give one of --corners \"p0 p1 p2 p3\", --at p --size a,b and "
        "--around \"from to\"");
  }
  if (in.given("around")) {
    const std::size_t count = in.points("around").size();
    if (count != 2)
      throw UsageError(fmt::format(
          "patch-grid: --around needs two points, the ends of the axis, not {}", count));
    for (const char* other : {"size", "twist", "taper", "bend", "mirrored"})
      if (in.given(other))
        throw UsageError(
            fmt::format("patch-grid: --{} cannot be combined with --around; leave it out", other));
    if (in.text("particles") == "spline")
      throw UsageError(
          "patch-grid: --particles spline cannot be combined with --around; give conforming or "
          "reduced");
  }
  validateOutline(in);
  validateLayers(in);
  (void)countOf(in);
  const double shift = in.number("shift");
  if (shift >= 1)
    throw UsageError(fmt::format(
        "patch-grid: --shift {} is out of range; give a fraction of a tile, at least 0 and below 1",
        shift));
}

std::array<V3d, 4> cornersOf(Invocation& in) {
  if (in.given("corners")) {
    const std::vector<V3d> points = in.points("corners");
    return {points[0], points[1], points[2], points[3]};
  }
  const std::array<double, 2> size = patchSizeOf(in);
  return mapping::cornersAround(in.band(), in.point("at"), size[0], size[1], in.radians("rotate"));
}

/// Returns the error message for a patch around a point whose corners turn out clockwise, as they
/// may on a strongly curved surface. Empty if the user gave the corners, or allows a mirrored
/// patch.
std::string whyMirrored(const Invocation& in, const mapping::PatchOptions& options) {
  if (in.given("corners") || options.mirror) return "";
  return fmt::format(
      "{}: the surface around {} bends too much for a patch of size {}: its corners would run "
      "clockwise; make it smaller, or place it elsewhere",
      in.op().name, in.text("at"), in.text("size"));
}

void requireUpright(const std::vector<mapping::Patch>& patches, const std::string& whyMirrored) {
  if (!whyMirrored.empty() && patches.front().mirrored) throw levelset::InvalidInput(whyMirrored);
}

/// Compares the sides of a patch around a point with --size, from which they differ on a curved
/// surface. Warns beyond 10 %.
/// @throws levelset::InvalidInput beyond a factor of 2
void requireSize(Invocation& in, const mapping::PatchReport& report) {
  if (in.op().name != "patch" || !in.given("at")) return;
  const std::array<double, 2> asked = patchSizeOf(in);
  const double u = report.uLength / asked[0], v = report.vLength / asked[1];
  const double least = std::min(u, v), most = std::max(u, v);
  if (least < 0.5 || most > 2) {
    throw levelset::InvalidInput(
        fmt::format("patch: the surface around {} bends too much for a patch of size {}: its sides "
                    "would be {:.4g} by {:.4g} long; make it smaller, or give its --corners",
                    in.text("at"), in.text("size"), report.uLength, report.vLength));
  }
  if (least < 0.9 || most > 1.1) {
    in.notes.warnings.push_back(
        fmt::format("patch: because of the curvature of the surface, a patch of size {} gets sides "
                    "of {:.4g} by {:.4g}; give its --corners for other sides",
                    in.text("size"), report.uLength, report.vLength));
  }
}

/// Reports the sizes and counts of new patches. Warns about particles that were slowed so that they
/// do not collide where a spline bends, and about a relaxation that did not converge.
void tellPatches(Invocation& in, const mapping::PatchReport& report,
                 const std::vector<mapping::Patch>& patches) {
  std::size_t particles = 0;
  for (const mapping::Patch& one : patches) particles += one.particleCount();
  const std::size_t layers = patches.front().layers.size();
  nlohmann::ordered_json json;
  if (patches.size() > 1) json["patches"] = patches.size();
  json["u_length"] = report.uLength;
  json["v_length"] = report.vLength;
  json["particles"] = particles;
  json["levels"] = layers;
  json["cell_area_variation"] = report.cellAreaVariation;
  json["relax_iterations"] = report.relaxIterations;
  json["relaxed"] = report.isRelaxed;
  json["projection_distance"] = report.projectionDistance;
  json["slowed"] = report.slowed;
  in.notes.detailsJson = json.dump();
  if (report.slowed > 0) {
    in.notes.warnings.push_back(
        fmt::format("{}: {} particles were slowed, since they would collide with their neighbours "
                    "where the spline bends too tightly for the width of the patch",
                    in.op().name, report.slowed));
  }
  if (!report.isRelaxed) {
    in.notes.warnings.push_back(
        fmt::format("{}: particles still moved after {} steps of relaxation, so the texture may be "
                    "stretched unevenly; make the patch smaller, raise --spacing, or place the "
                    "patch where the surface is flatter",
                    in.op().name, report.relaxIterations));
  }
  in.notes.notes.push_back(fmt::format(
      "{:.4g} by {:.4g} along the surface, {}{} particles in {} layers", report.uLength,
      report.vLength, patches.size() > 1 ? fmt::format("{} patches, ", patches.size()) : "",
      particles, layers));
}

/// Builds patches at the requested height. With --height auto, also stores how to rebuild them at
/// the height that the texture determines.
/// @param make  builds the patches and their report for a height in world units
template <typename Make>
Value patchesOf(Invocation& in, PatchRecipe recipe, const Make& make) {
  const bool isAuto = in.text("height") == "auto";
  // With --height auto, a height of one voxel suffices to measure the patch on the surface.
  auto [patches, report] = make(isAuto ? in.band().voxelSize() : in.length("height"), in.progress);
  requireSize(in, report);
  tellPatches(in, report, patches);
  PatchValue value;
  value.patches = std::move(patches);
  tellOrigin(in, recipe);
  value.recipe = std::make_shared<const PatchRecipe>(std::move(recipe));
  if (isAuto) {
    value.atHeight = [make](double h, const levelset::Progress& progress) {
      return make(h, progress).patches;
    };
  }
  return Value(std::move(value));
}

using levelset::Progress;
using mapping::PatchGridResult;

PatchGridResult asSet(mapping::PatchResult result) {
  PatchGridResult set;
  set.patches.push_back(std::move(result.patch));
  set.report = result.report;
  return set;
}

/// Returns the options of a patch that moves from the footprint `origin` to `now`. Its spline and
/// directions move with it. The animation checks later if the corners have become clockwise.
mapping::PatchOptions optionsElsewhere(mapping::PatchOptions options,
                                       const mapping::Footprint& origin,
                                       const mapping::Footprint& now, const Progress& progress) {
  for (V3d& p : options.spline) p = mapping::movedAlong(origin, now, p);
  for (V3d& d : options.directions)
    d = mapping::movedAlong(origin, now, origin.centre + d) -
        mapping::movedAlong(origin, now, origin.centre);
  options.progress = progress;
  return options;
}

std::string whyFixed(const Invocation& in) {
  for (const char* side : kSides)
    if (in.given(side))
      return fmt::format("--{} of '{}' names points that do not move with the surface", side,
                         in.op().name);
  return "";
}

Value patch(Invocation& in) {
  mapping::PatchOptions options = patchOptionsOf(in);
  for (std::size_t side = 0; side < 4; ++side)
    if (in.given(kSides[side])) options.sides[side] = in.points(kSides[side]);
  PatchRecipe recipe{.outlines = outlinesOf, .fixed = whyFixed(in)};
  recipe.make = [options](const levelset::NarrowBand& base,
                          std::span<const mapping::Footprint> footprints,
                          std::span<const mapping::Footprint> origins, const Progress& progress) {
    mapping::PatchOptions now = optionsElsewhere(options, origins[0], footprints[0], progress);
    now.mirror = true;
    return std::vector{
        mapping::makePatch(base, footprints[0].corners, footprints[0].height, now).patch};
  };
  return patchesOf(in, std::move(recipe),
                   [base = in.band(), corners = cornersOf(in), options,
                    why = whyMirrored(in, options)](double height, const Progress& progress) {
                     mapping::PatchOptions now = options;
                     now.progress = progress;
                     now.mirror |= !why.empty();
                     PatchGridResult set = asSet(mapping::makePatch(base, corners, height, now));
                     requireUpright(set.patches, why);
                     return set;
                   });
}

/// Mean of |u| and |v| over the four corners, relative to the centre; world units along the
/// surface.
double meanReach(const mapping::Footprint& footprint) {
  double sum = 0;
  for (const Imath::V2d& way : footprint.reach.value()) sum += std::abs(way.x) + std::abs(way.y);
  return sum / 8;
}

Value decal(Invocation& in) {
  const mapping::PatchOptions options = patchOptionsOf(in);
  const V3d at = in.point("at"), direction = in.point("direction");
  const double radius = in.length("radius");
  PatchRecipe recipe{.isRigid = true};
  recipe.outlines = [at, direction](const std::vector<mapping::Patch>& patches) {
    std::vector<mapping::PatchOutline> outlines = outlinesOf(patches);
    outlines.front().middle = at;
    outlines.front().direction = direction;
    return outlines;
  };
  recipe.make = [options, radius](const levelset::NarrowBand& base,
                                  std::span<const mapping::Footprint> footprints,
                                  std::span<const mapping::Footprint> origins,
                                  const Progress& progress) {
    const mapping::Footprint& now = footprints[0];
    return std::vector{mapping::makeDecal(base, now.centre, now.direction,
                                          radius * meanReach(now) / meanReach(origins[0]),
                                          now.height,
                                          optionsElsewhere(options, origins[0], now, progress))
                           .patch};
  };
  return patchesOf(
      in, std::move(recipe),
      [base = in.band(), at, direction, radius, options](double height, const Progress& progress) {
        mapping::PatchOptions now = options;
        now.progress = progress;
        return asSet(mapping::makeDecal(base, at, direction, radius, height, now));
      });
}

Value gridAround(Invocation& in, const mapping::PatchGridOptions& grid,
                 const mapping::PatchOptions& options) {
  const auto make = [axis = in.points("around"), rotation = in.radians("rotate"), grid, options](
                        const levelset::NarrowBand& base, double height, const Progress& progress) {
    mapping::PatchOptions now = options;
    now.progress = progress;
    return mapping::makePatchGridAround(base, axis[0], axis[1], rotation, height, grid, now);
  };
  const PatchRecipe recipe{
      .around = [make](const levelset::NarrowBand& base, double height, const Progress& progress) {
        return make(base, height, progress).patches;
      }};
  return patchesOf(in, recipe, [make, base = in.band()](double height, const Progress& progress) {
    return make(base, height, progress);
  });
}

Value patchGrid(Invocation& in) {
  const auto [columns, rows] = countOf(in);
  const std::string mirror = in.text("mirror");
  const mapping::PatchGridOptions grid = {.columns = columns,
                                          .rows = rows,
                                          .mirrorU = mirror == "u" || mirror == "both",
                                          .mirrorV = mirror == "v" || mirror == "both",
                                          .shift = in.number("shift")};
  mapping::PatchOptions options = patchOptionsOf(in);
  options.mirror = in.flag("mirrored");
  if (in.given("around")) return gridAround(in, grid, options);
  for (std::size_t side = 0; side < 4; ++side)
    if (in.given(kSides[side])) options.sides[side] = in.points(kSides[side]);
  const std::array<V3d, 4> corners = cornersOf(in);
  PatchRecipe recipe{.fixed = whyFixed(in)};
  // All tiles use one outline, so that they keep their shared borders.
  recipe.outlines = [corners](const std::vector<mapping::Patch>& patches) {
    const mapping::Patch& middle = patches[patches.size() / 2];
    return std::vector<mapping::PatchOutline>{
        {.corners = corners, .middle = mapping::outlineOf(middle).middle, .height = middle.height}};
  };
  recipe.make = [grid, options](const levelset::NarrowBand& base,
                                std::span<const mapping::Footprint> footprints,
                                std::span<const mapping::Footprint> origins,
                                const Progress& progress) {
    mapping::PatchOptions now = optionsElsewhere(options, origins[0], footprints[0], progress);
    now.mirror = true;
    return mapping::makePatchGrid(base, footprints[0].corners, footprints[0].height, grid, now)
        .patches;
  };
  return patchesOf(in, std::move(recipe),
                   [base = in.band(), corners, grid, options, why = whyMirrored(in, options)](
                       double height, const Progress& progress) {
                     mapping::PatchOptions now = options;
                     now.progress = progress;
                     now.mirror |= !why.empty();
                     PatchGridResult set = mapping::makePatchGrid(base, corners, height, grid, now);
                     requireUpright(set.patches, why);
                     return set;
                   });
}

/// Returns the parameters of the layers above the surface.
/// @param particles  default of --particles
std::vector<Param> layerParams(const char* particles) {
  std::vector<Param> params = withLayers({});
  for (Param& param : params)
    if (param.name == "particles") param.fallback = particles;
  params.push_back({.name = "spline",
                    .type = ParamType::Points,
                    .doc = "with --particles spline: points of the curve after the centre of the "
                           "patch; default: a straight line along the normal"});
  params.push_back(
      {.name = "fade",
       .type = ParamType::Flag,
       .doc = "with --particles spline: the relief of the base surface fades out along the curve"});
  return params;
}

std::vector<Param> outlineParams() {
  return {
      {.name = "corners",
       .type = ParamType::Points,
       .doc = "corners of the patch, anticlockwise seen from outside: four points \"p0 p1 p2 p3\""},
      {.name = "at",
       .type = ParamType::Point,
       .doc = "centre of a patch whose lengths --size gives"},
      {.name = "size",
       .type = ParamType::Lengths,
       .doc = "lengths of the patch along u and along v, measured on the surface",
       .range = Range::Positive,
       .count = 2},
      {.name = "side0",
       .type = ParamType::Points,
       .doc = "points through which the side from corner 0 to 1 passes, on shortest paths between "
              "them"},
      {.name = "side1",
       .type = ParamType::Points,
       .doc = "points through which the side from corner 1 to 2 passes"},
      {.name = "side2",
       .type = ParamType::Points,
       .doc = "points through which the side from corner 3 to 2 passes"},
      {.name = "side3",
       .type = ParamType::Points,
       .doc = "points through which the side from corner 0 to 3 passes"}};
}

std::vector<Param> joinParams(std::vector<Param> a, const std::vector<Param>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace

Operator patchOperator() {
  return {
      .name = "patch",
      .group = "Texture mapping",
      .summary = "lay a patch onto a surface, for a texture to be mapped onto",
      .details =
          "Points are projected to the surface along the gradient of the distance. u runs from "
          "corner 0 to 1, v from corner 0 to 3, w outwards; corners run anticlockwise seen from "
          "outside. Sides are shortest paths on the surface. Points of --side0 to --side3 divide a "
          "side into several shortest paths, which may meet at an angle.",
      .example =
          "levelsmith sphere --radius 10 --voxel 0.5 --as ball ! patch @ball --at 0,0,10 "
          "--size 8,8 --height 3 --as p "
          "! torus --radius 4 --tube 1.5 --voxel 0.5 --as ring ! texture @ball @ring @p "
          "--blend 1 ! mesh ! write ring.ply",
      .params = joinParams(
          joinParams(outlineParams(),
                     {{.name = "rotate",
                       .type = ParamType::Degrees,
                       .doc = "with --at: rotation of the direction u about the surface normal",
                       .fallback = "0"}}),
          joinParams(layerParams("reduced"),
                     {{.name = "directions",
                       .type = ParamType::Points,
                       .doc = "with --particles reduced: directions in which the corners rise from "
                              "the surface, one for all or \"d0 d1 d2 d3\"; default: along the "
                              "gradient of the distance"},
                      {.name = "parallel",
                       .type = ParamType::Flag,
                       .doc = "with --particles reduced: all corners rise along the normal at the "
                              "centre of the patch"},
                      {.name = "mirror",
                       .type = ParamType::Flag,
                       .doc = "accept corners that run clockwise seen from outside, which mirrors "
                              "the texture"}})),
      .operands = {{Kind::Band, Kind::Surface}},
      .resultKind = [](const Invocation&) { return Kind::Patch; },
      .run = patch,
      .plan = planPatch,
      .validate = validatePatch,
  };
}

Operator decalOperator() {
  return {
      .name = "decal",
      .group = "Texture mapping",
      .summary = "lay a square patch onto a surface about one point",
      .details =
          "Distances and directions from the point are kept: every particle lies at the end of a "
          "geodesic that starts in its direction. A decal that would fold, overlap itself or leave "
          "the surface is an error, which gives a radius that works.",
      .example =
          "levelsmith cylinder --radius 8 --height 30 --voxel 0.4 --as post ! decal @post "
          "--at 8,0,0 --direction 0,1,0 --radius 6 --height 2 --as p "
          "! torus --radius 4 --tube 1 --voxel 0.3 --as ring ! texture @post @ring @p "
          "! mesh ! write post.ply",
      .params = joinParams(
          {{.name = "at",
            .type = ParamType::Point,
            .doc = "centre of the decal, which is projected to the surface",
            .required = true},
           {.name = "direction",
            .type = ParamType::Point,
            .doc = "direction of u at the centre; only its tangential part is used",
            .required = true},
           {.name = "radius",
            .type = ParamType::Length,
            .doc = "half the side of the square, measured along the surface",
            .range = Range::Positive,
            .required = true}},
          joinParams(layerParams("reduced"),
                     {{.name = "mirror",
                       .type = ParamType::Flag,
                       .doc = "reverse the direction of v, which mirrors the texture"}})),
      .operands = {{Kind::Band, Kind::Surface}},
      .resultKind = [](const Invocation&) { return Kind::Patch; },
      .run = decal,
      .plan = planDecal,
      .validate = validateLayers,
  };
}

Operator patchGridOperator() {
  return {
      .name = "patch-grid",
      .group = "Texture mapping",
      .summary = "tile a patch, or all around an axis, with patches whose textures meet",
      .details =
          "Neighbours share the particles of their common border. With --around the tiles form a "
          "closed ring: u runs around the axis, anticlockwise seen from its second point, and v "
          "runs along the axis between the planes through the two points. A texture continues in "
          "the next tile where it reaches the border of its box, see --texture-box.",
      .example =
          "levelsmith cylinder --radius 5 --height 20 --voxel 0.4 --as grip ! patch-grid "
          "@grip --count 8,4 --around \"0,0,-6 0,0,6\" --height 0.8 --as p "
          "! box --size 1,1,1 --voxel 0.2 --as stud ! texture @grip @stud @p "
          "--texture-box \"-1,-1,-0.5 1,1,0.5\" ! mesh ! write grip.ply",
      .params = joinParams(
          joinParams({{.name = "count",
                       .type = ParamType::Text,
                       .doc = "numbers of tiles along u and along v, as 12,3",
                       .required = true}},
                     outlineParams()),
          joinParams(
              {{.name = "around",
                .type = ParamType::Points,
                .doc = "tile the surface all around the axis between two points, \"from to\""},
               {.name = "rotate",
                .type = ParamType::Degrees,
                .doc = "with --at: rotation of the direction u about the surface normal; with "
                       "--around: angle about the axis at which the first tile begins",
                .fallback = "0"},
               {.name = "mirror",
                .type = ParamType::Choice,
                .doc = "mirror every other tile along u, along v, or along both",
                .fallback = "none",
                .choices = {"none", "u", "v", "both"}},
               {.name = "shift",
                .type = ParamType::Number,
                .doc = "shift of every other row along u, as a fraction of a tile, below 1; "
                       "without --around such a row has one tile less",
                .fallback = "0",
                .range = Range::NonNegative},
               {.name = "mirrored",
                .type = ParamType::Flag,
                .doc = "accept corners that run clockwise seen from outside, which mirrors the "
                       "textures"}},
              layerParams("conforming"))),
      .operands = {{Kind::Band, Kind::Surface}},
      .resultKind = [](const Invocation&) { return Kind::Patch; },
      .run = patchGrid,
      .plan = planGrid,
      .validate = validateGrid,
  };
}

}  // namespace pipeline
