#include <fmt/core.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/pipeline/invocation.h"
#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/patch_options.h"
#include "levelset/error.h"
#include "mapping/patches/patch.h"

namespace pipeline {
namespace {

using Imath::V3d;
using levelset::UsageError;

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
  validateLevels(in);
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
  mapping::PatchOptions options = patchOptionsOf(in);
  const std::array<V3d, 4> corners = cornersOf(in);
  const bool isAuto = in.text("height") == "auto";
  // The texture will tell the height; one voxel is enough to know the patch's size until then.
  const double height = isAuto ? in.band().voxelSize() : in.length("height");
  mapping::PatchResult result = mapping::makePatch(in.band(), corners, height, options);
  const mapping::PatchReport& report = result.report;
  nlohmann::ordered_json json;
  json["u_length"] = report.uLength;
  json["v_length"] = report.vLength;
  json["particles"] = result.patch.particleCount();
  json["levels"] = result.patch.levels.size();
  json["cell_area_variation"] = report.cellAreaVariation;
  json["relax_iterations"] = report.relaxIterations;
  json["projection_distance"] = report.projectionDistance;
  json["slowed"] = report.slowed;
  in.notes.detailsJson = json.dump();
  if (report.slowed > 0) {
    in.notes.warnings.push_back(fmt::format(
        "patch: {} of its particles would cross their neighbours where the spline bends "
        "more narrowly than the patch is wide; they were slowed",
        report.slowed));
  }
  in.notes.notes.push_back(
      fmt::format("{:.4g} by {:.4g} along the surface, {} particles in {} levels", report.uLength,
                  report.vLength, result.patch.particleCount(), result.patch.levels.size()));
  PatchValue value;
  value.patches.push_back(std::move(result.patch));
  if (isAuto) {
    options.progress = {};
    value.atHeight = [base = in.band(), corners, options](double h) {
      return std::vector{mapping::makePatch(base, corners, h, options).patch};
    };
  }
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

}  // namespace

void addPatchOperators(std::vector<Operator>& all) {
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
      .params = withLevels(
          {{.name = "corners", .type = ParamType::Points, .doc = "four points, \"p0 p1 p2 p3\""},
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
           {.name = "spline",
            .type = ParamType::Points,
            .doc = "with --particles spline: points that its curve passes from the patch's "
                   "centre on; default: straight along the normal"},
           {.name = "fade",
            .type = ParamType::Flag,
            .doc = "with --particles spline: the surface's relief goes to nothing on the way"},
           {.name = "mirror",
            .type = ParamType::Flag,
            .doc = "accept corners that run clockwise: the texture is mirrored"}}),
      .operands = {{Kind::Band}},
      .resultKind = [](const Invocation&) { return Kind::Patch; },
      .run = patch,
      .plan = planPatch,
      .validate = validatePatch,
  });
}

}  // namespace pipeline
