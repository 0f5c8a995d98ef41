#include <fmt/core.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/pipeline/invocation.h"
#include "apps/pipeline/operators/common.h"
#include "levelset/error.h"
#include "mapping/geometric_texture.h"
#include "mapping/patch.h"

namespace pipeline {
namespace {

using Imath::V3d;
using levelset::UsageError;

constexpr long kMostLevels = 1000;

void validatePatch(const Invocation& in) {
  if (in.given("corners") == in.given("at"))
    throw UsageError("patch: give either --corners \"p0 p1 p2 p3\" or --at p --size a,b");
  if (in.given("at") && !in.given("size"))
    throw UsageError("patch: --at needs --size a,b beside it");
  if (in.given("corners")) {
    if (in.given("size") || in.given("rotate"))
      throw UsageError("patch: --size and --rotate go with --at, not with --corners");
    const std::size_t count = in.points("corners").size();
    if (count != 4)
      throw UsageError(fmt::format("patch: --corners needs four points, not {}", count));
  }
  const long levels = in.integer("levels");
  if (levels < 2 || levels > kMostLevels) {
    throw UsageError(
        fmt::format("patch: --levels {} is out of range; give 2 to {}", levels, kMostLevels));
  }
}

std::array<V3d, 4> cornersOf(Invocation& in) {
  if (in.given("corners")) {
    const std::vector<V3d> points = in.points("corners");
    return {points[0], points[1], points[2], points[3]};
  }
  const std::vector<double> size = in.lengths("size");
  for (const double side : size) {
    if (side > 10 * in.operands[0].diagonal()) {
      throw levelset::InvalidInput(fmt::format(
          "patch: --size {} is over ten times the solid's diagonal of {:.6g}; make it smaller",
          in.text("size"), in.operands[0].diagonal()));
    }
  }
  return mapping::cornersAround(in.band(), in.point("at"), size[0], size[1], in.radians("rotate"));
}

Value patch(Invocation& in) {
  PatchValue value;
  value.base = in.band();
  value.autoHeight = in.text("height") == "auto";
  value.options = {.levels = static_cast<std::size_t>(in.integer("levels")),
                   .spacing = in.given("spacing") ? in.length("spacing") : 0,
                   .mirror = in.flag("mirror"),
                   .maxMemory = in.maxMemory,
                   .progress = in.progress};
  value.corners = cornersOf(in);
  // The texture will tell the height; one voxel is enough to know the patch's size until then.
  const double height = value.autoHeight ? in.band().voxelSize() : in.length("height");
  mapping::PatchResult result =
      mapping::makePatch(value.base, value.corners, height, value.options);
  const mapping::PatchReport& report = result.report;
  nlohmann::ordered_json json;
  json["u_length"] = report.uLength;
  json["v_length"] = report.vLength;
  json["particles"] = result.patch.particleCount();
  json["levels"] = result.patch.levels.size();
  json["cell_area_variation"] = report.cellAreaVariation;
  json["relax_iterations"] = report.relaxIterations;
  json["projection_distance"] = report.projectionDistance;
  in.notes.detailsJson = json.dump();
  in.notes.notes.push_back(
      fmt::format("{:.4g} by {:.4g} along the surface, {} particles in {} levels", report.uLength,
                  report.vLength, result.patch.particleCount(), result.patch.levels.size()));
  value.patch = std::move(result.patch);
  value.options.progress = {};
  return Value(std::move(value));
}

Plan planPatch(Invocation& in) {
  Plan plan = in.operands[0].plan();
  plan.kind = Kind::Patch;
  Imath::Box3d box;
  if (in.given("corners")) {
    const std::vector<V3d> p = in.points("corners");
    for (const V3d& corner : p) box.extendBy(corner);
    plan.patchSize = {std::min((p[1] - p[0]).length(), (p[2] - p[3]).length()),
                      std::min((p[3] - p[0]).length(), (p[2] - p[1]).length()), 0};
  } else {
    const std::vector<double> size = in.lengths("size");
    plan.patchSize = {size[0], size[1], 0};
    const double reach = std::hypot(size[0], size[1]) / 2;
    box = {in.point("at") - V3d(reach), in.point("at") + V3d(reach)};
  }
  const bool isAuto = in.text("height") == "auto";
  const double height = isAuto ? box.size().length() / 2 : in.length("height");
  if (!isAuto) plan.patchSize.z = height;
  box.min -= V3d(height);
  box.max += V3d(height);
  plan.bounds = box;
  plan.area = 0;
  return plan;
}

/// Height that keeps the texture's proportions on a patch of this size.
double aspectHeight(const mapping::Patch& patch, const Imath::Box3d& textureBox) {
  const mapping::ParticleLevel& level = patch.levels.front();
  double u = 0, v = 0;
  for (std::size_t row = 0; row < level.rows; ++row)
    for (std::size_t column = 1; column < level.columns; ++column)
      u += (level.at(column, row) - level.at(column - 1, row)).length();
  for (std::size_t column = 0; column < level.columns; ++column)
    for (std::size_t row = 1; row < level.rows; ++row)
      v += (level.at(column, row) - level.at(column, row - 1)).length();
  u /= static_cast<double>(level.rows);
  v /= static_cast<double>(level.columns);
  const V3d size = textureBox.size();
  return size.z * std::sqrt(u / size.x * v / size.y);
}

std::string detailsOf(const mapping::TextureReport& report, double height) {
  nlohmann::ordered_json json;
  json["voxel_size"] = report.voxelSize;
  json["height"] = height;
  json["particles"] = report.particles;
  json["blocks_tested"] = report.blocksTested;
  json["blocks_evaluated"] = report.blocksEvaluated;
  json["min_jacobian"] = report.minJacobian;
  json["min_stretch"] = report.minStretch;
  json["max_stretch"] = report.maxStretch;
  json["map_residual"] = report.mapResidual;
  return json.dump();
}

Value texture(Invocation& in) {
  const PatchValue& onto = in.operands[2].patch();
  mapping::TextureOptions options;
  if (in.flag("carve")) options.merge = mapping::TextureMerge::Carve;
  if (in.flag("alone")) options.merge = mapping::TextureMerge::Alone;
  options.sink = in.length("sink");
  options.blend = in.length("blend");
  if (in.given("texture-box")) options.textureBox = in.box("texture-box");
  if (in.given("voxel")) options.voxelSize = in.length("voxel");
  options.halfWidth = in.number("half-width");
  options.rbf.lambdaNear = in.number("lambda-near");
  options.rbf.lambdaFar = in.number("lambda-far");
  options.allowFolds = in.flag("allow-folds");
  options.maxMemory = in.maxMemory;
  options.progress = in.progress;
  mapping::Patch patch = onto.patch;
  if (onto.autoHeight) {
    const double height = aspectHeight(
        patch, options.textureBox ? *options.textureBox : in.operands[1].plan().bounds);
    patch = mapping::makePatch(onto.base, onto.corners, height, onto.options).patch;
    in.notes.notes.push_back(
        fmt::format("--height auto: {:.6g} keeps the texture's proportions", height));
  }
  mapping::TextureResult result = mapping::mapTexture(in.band(0), in.band(1), patch, options);
  in.notes.detailsJson = detailsOf(result.report, patch.height);
  in.notes.errors.push_back({"map residual at particles, largest",
                             result.report.mapResidual / result.report.voxelSize, "voxels"});
  in.notes.notes.insert(in.notes.notes.end(), result.report.notes.begin(),
                        result.report.notes.end());
  in.notes.notes.push_back(
      fmt::format("smallest Jacobian {:.3g}, stretch {:.3g} to {:.3g}, {} of {} blocks evaluated",
                  result.report.minJacobian, result.report.minStretch, result.report.maxStretch,
                  result.report.blocksEvaluated, result.report.blocksTested));
  return Value(std::move(result.band));
}

/// How far the flattest map of the texture's box onto the patch squeezes: the run surveys the real
/// one.
double plannedStretch(const Invocation& in, const Plan& texture, const Plan& patch) {
  const V3d box = in.given("texture-box") ? in.box("texture-box").size() : texture.bounds.size();
  double stretch = HUGE_VAL;
  for (int axis = 0; axis < 3; ++axis)
    if (patch.patchSize[axis] > 0 && box[axis] > 0)
      stretch = std::min(stretch, patch.patchSize[axis] / box[axis]);
  return std::isfinite(stretch) ? stretch : 1;
}

Plan planTexture(Invocation& in) {
  Plan plan = in.operands[0].plan();
  const Plan &texture = in.operands[1].plan(), &patch = in.operands[2].plan();
  plan.voxelSize = in.given("voxel") ? in.length("voxel")
                                     : mapping::resultVoxelSize(plan.voxelSize, texture.voxelSize,
                                                                plannedStretch(in, texture, patch));
  const double from = texture.bounds.size().length(), to = patch.bounds.size().length();
  const double scale = from > 0 ? to / from : 1;
  plan.area = (in.flag("alone") ? 0 : plan.area) + texture.area * scale * scale;
  plan.bounds.extendBy(patch.bounds);
  return plan;
}

}  // namespace

void addTextureOperators(std::vector<Operator>& all) {
  all.push_back({
      .name = "patch",
      .group = "Texture mapping",
      .summary = "lay a patch onto a surface: where a texture will stand",
      .details = "Points are projected to the surface along the distance. u runs from corner 0 to "
                 "1, v from corner 0 to 3, w "
                 "outwards; corners run anticlockwise seen from outside.",
      .example = "levelsmith sphere --radius 10 --voxel 0.5 --as ball ! patch @ball --at 0,0,10 "
                 "--size 8,8 --height 3 --as p "
                 "! torus --radius 4 --tube 1.5 --voxel 0.5 --as ring ! texture @ball @ring @p "
                 "--blend 1 ! mesh ! write ring.ply",
      .params = {{.name = "corners",
                  .type = ParamType::Points,
                  .doc = "four points, \"p0 p1 p2 p3\""},
                 {.name = "at", .type = ParamType::Point, .doc = "centre of a patch of --size"},
                 {.name = "size",
                  .type = ParamType::Lengths,
                  .doc = "along u and v, on the surface",
                  .range = Range::Positive,
                  .count = 2},
                 {.name = "rotate",
                  .type = ParamType::Degrees,
                  .doc = "of u about the normal, with --at",
                  .fallback = "0"},
                 {.name = "height",
                  .type = ParamType::Length,
                  .doc = "of the texture; 'auto' keeps its proportions",
                  .range = Range::Positive,
                  .required = true,
                  .allowsAuto = true},
                 {.name = "levels",
                  .type = ParamType::Integer,
                  .doc = "of particles, 2 or more",
                  .fallback = "6",
                  .range = Range::Positive},
                 {.name = "particles",
                  .type = ParamType::Choice,
                  .doc = "how they are laid above the surface",
                  .fallback = "reduced",
                  .choices = {"reduced"}},
                 {.name = "spacing",
                  .type = ParamType::Length,
                  .doc = "of particles; default: by patch and voxel size",
                  .range = Range::Positive},
                 {.name = "mirror",
                  .type = ParamType::Flag,
                  .doc = "accept corners that run clockwise: the texture is mirrored"}},
      .operands = {{Kind::Band}},
      .resultKind = [](const Invocation&) { return Kind::Patch; },
      .run = patch,
      .plan = planPatch,
      .validate = validatePatch,
  });
  all.push_back({
      .name = "texture",
      .group = "Texture mapping",
      .summary = "map a solid onto a patch of a surface, and join the two",
      .details = "The operands are base, texture and patch. The texture's zero-set box is the unit "
                 "cube of u, v, w. A map that "
                 "folds is refused with the place.",
      .example =
          "levelsmith box --size 40,40,10 --voxel 0.5 --as base ! torus --radius 4 --tube "
          "1.5 --voxel 0.25 --as rings "
          "! patch @base --corners \"-10,-10,5 10,-10,5 10,10,5 -10,10,5\" --height 8 "
          "--levels 6 --as p "
          "! texture @base @rings @p --map rbf --blend 1 ! write out.vdb ! mesh ! write out.ply",
      .params =
          {{.name = "map",
            .type = ParamType::Choice,
            .doc = "from patch to texture",
            .fallback = "rbf",
            .choices = {"rbf"}},
           {.name = "sink",
            .type = ParamType::Length,
            .doc = "how deep the texture dips into the base",
            .fallback = "1vx",
            .range = Range::NonNegative},
           {.name = "blend",
            .type = ParamType::Length,
            .doc = "radius along the seam",
            .fallback = "0",
            .range = Range::NonNegative},
           {.name = "carve", .type = ParamType::Flag, .doc = "cut the texture out of the base"},
           {.name = "alone", .type = ParamType::Flag, .doc = "only the mapped texture"},
           {.name = "texture-box",
            .type = ParamType::Box,
            .doc = "what of the texture's space is mapped onto the patch"},
           voxelParam("of the result; default: the finest of base and texture x smallest stretch"),
           halfWidthParam(),
           {.name = "lambda-near",
            .type = ParamType::Number,
            .doc = "relaxation of the map at the surface, in mean particle spacings",
            .fallback = "0.005",
            .range = Range::NonNegative},
           {.name = "lambda-far",
            .type = ParamType::Number,
            .doc = "the same above the surface",
            .fallback = "0.25",
            .range = Range::NonNegative},
           {.name = "allow-folds", .type = ParamType::Flag, .doc = "map even where the map folds"}},
      .operands = {{Kind::Band}, {Kind::Band}, {Kind::Patch}},
      .run = texture,
      .plan = planTexture,
      .validate =
          [](const Invocation& in) {
            if (in.flag("carve") && in.flag("alone"))
              throw UsageError("texture: --carve and --alone exclude each other");
            if (in.flag("alone") && in.given("blend"))
              throw UsageError("texture: --alone has no seam to blend; leave --blend out");
          },
  });
}

}  // namespace pipeline
