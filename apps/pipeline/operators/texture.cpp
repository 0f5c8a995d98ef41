#include <fmt/core.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/pipeline/invocation.h"
#include "apps/pipeline/operators/common.h"
#include "levelset/error.h"
#include "mapping/patches/patch.h"
#include "mapping/textures/geometric_texture.h"
#include "mapping/textures/mesh_texture.h"

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
  if (in.text("particles") != "spline" && (in.given("spline") || in.flag("fade")))
    throw UsageError("patch: --spline and --fade go with --particles spline");
  if (in.text("particles") == "spline" && in.text("height") == "auto")
    throw UsageError(
        "patch: --height auto does not go with --particles spline; give the length "
        "along the spline");
  const long levels = in.integer("levels");
  if (levels < 2 || levels > kMostLevels) {
    throw UsageError(
        fmt::format("patch: --levels {} is out of range; give 2 to {}", levels, kMostLevels));
  }
}

mapping::LevelScheme schemeOf(const Invocation& in) {
  const std::string name = in.text("particles");
  if (name == "conforming") return mapping::LevelScheme::Conforming;
  return name == "spline" ? mapping::LevelScheme::Spline : mapping::LevelScheme::Reduced;
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
                   .scheme = schemeOf(in),
                   .fade = in.flag("fade"),
                   .spacing = in.given("spacing") ? in.length("spacing") : 0,
                   .mirror = in.flag("mirror"),
                   .maxMemory = in.maxMemory,
                   .progress = in.progress};
  if (in.given("spline")) value.options.spline = in.points("spline");
  value.options.transform = {
      .twist = in.radians("twist"), .taper = in.number("taper"), .bend = in.radians("bend")};
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

nlohmann::ordered_json spreadOf(const mapping::Spread& spread) {
  nlohmann::ordered_json json;
  json["min"] = spread.least;
  json["percent_1"] = spread.percent1;
  json["median"] = spread.median;
  json["percent_99"] = spread.percent99;
  json["max"] = spread.most;
  return json;
}

void addDistortion(const mapping::Distortion& distortion, nlohmann::ordered_json& json) {
  json["folded"] = distortion.folded;
  json["samples"] = distortion.samples;
  json["min_jacobian"] = distortion.jacobian.least;
  json["min_stretch"] = distortion.stretch.least;
  json["max_stretch"] = distortion.stretch.most;
  json["jacobian"] = spreadOf(distortion.jacobian);
  json["stretch"] = spreadOf(distortion.stretch);
}

const std::vector<std::string> kKernelNames = {"biharmonic", "triharmonic", "thin-plate",
                                               "sum",        "laplacian",   "gaussian"};

mapping::RbfKernel kernelOf(const std::string& name) {
  for (std::size_t n = 0; n < kKernelNames.size(); ++n)
    if (kKernelNames[n] == name) return static_cast<mapping::RbfKernel>(n);
  return mapping::RbfKernel::Biharmonic;
}

void addSolve(const mapping::RbfSolveReport& solve, nlohmann::ordered_json& json) {
  json["solved_by"] = solve.isIterative ? "iteration" : "factors";
  json["iterations"] = solve.iterations;
  json["solve_residual"] = solve.solveResidual;
  json["condition"] = solve.condition;
  json["regularized"] = solve.isRegularized;
  json["directions"] = solve.directions;
  json["merged"] = solve.merged;
  json["averaged"] = solve.averaged;
}

std::string detailsOf(const mapping::TextureReport& report, double height, bool isRbf) {
  nlohmann::ordered_json json;
  json["voxel_size"] = report.voxelSize;
  json["height"] = height;
  json["particles"] = report.particles;
  json["blocks_tested"] = report.blocksTested;
  json["blocks_evaluated"] = report.blocksEvaluated;
  json["operations_per_point"] = report.operationsPerPoint;
  addDistortion(report.distortion, json);
  json["map_residual"] = report.mapResidual;
  if (isRbf) addSolve(report.solve, json);
  return json.dump();
}

bool mapsMesh(const Invocation& in) {
  return in.text("map") == "mesh";
}

/// The patch at the height that the texture asks for.
mapping::Patch patchFor(Invocation& in, const Imath::Box3d& textureBox) {
  const PatchValue& onto = in.operands[2].patch();
  if (!onto.autoHeight) return onto.patch;
  const double height = aspectHeight(onto.patch, textureBox);
  in.notes.notes.push_back(
      fmt::format("--height auto: {:.6g} keeps the texture's proportions", height));
  return mapping::makePatch(onto.base, onto.corners, height, onto.options).patch;
}

Imath::Box3d textureBoxOf(const Invocation& in) {
  return in.given("texture-box") ? in.box("texture-box") : in.operands[1].plan().bounds;
}

Value textureMesh(Invocation& in) {
  const mapping::Patch patch = patchFor(in, textureBoxOf(in));
  mapping::MeshTextureOptions options;
  options.sink = in.length("sink");
  if (in.given("texture-box")) options.textureBox = in.box("texture-box");
  options.allowFolds = in.flag("allow-folds");
  options.maxMemory = in.maxMemory;
  options.progress = in.progress;
  mapping::requirePatchOn(in.band(0), patch);
  mapping::MeshTextureResult result = mapping::mapMesh(in.mesh(1), patch, options);
  nlohmann::ordered_json json;
  json["height"] = patch.height;
  json["particles"] = patch.particleCount();
  addDistortion(result.distortion, json);
  in.notes.detailsJson = json.dump();
  in.notes.notes.insert(in.notes.notes.end(), result.notes.begin(), result.notes.end());
  in.notes.notes.push_back(fmt::format("{} vertices moved, smallest Jacobian {:.3g}",
                                       result.mesh.positions.size(),
                                       result.distortion.jacobian.least));
  return Value(std::move(result.mesh));
}

Value texture(Invocation& in) {
  if (mapsMesh(in)) return textureMesh(in);
  mapping::TextureOptions options;
  if (in.flag("carve")) options.merge = mapping::TextureMerge::Carve;
  if (in.flag("alone")) options.merge = mapping::TextureMerge::Alone;
  options.sink = in.length("sink");
  options.blend = in.length("blend");
  if (in.given("texture-box")) options.textureBox = in.box("texture-box");
  if (in.given("voxel")) options.voxelSize = in.length("voxel");
  options.halfWidth = in.number("half-width");
  if (in.text("map") == "shell") options.map = mapping::TextureMap::Shell;
  options.mapTolerance = in.number("map-tolerance");
  options.rbf.kernel = kernelOf(in.text("kernel"));
  options.rbf.lambdaNear = in.number("lambda-near");
  options.rbf.lambdaFar = in.number("lambda-far");
  options.allowFolds = in.flag("allow-folds");
  options.maxMemory = in.maxMemory;
  options.progress = in.progress;
  const mapping::Patch patch = patchFor(in, textureBoxOf(in));
  mapping::TextureResult result = mapping::mapTexture(in.band(0), in.band(1), patch, options);
  in.notes.detailsJson =
      detailsOf(result.report, patch.height, options.map == mapping::TextureMap::Rbf);
  in.notes.errors.push_back({"map residual at particles, largest",
                             result.report.mapResidual / result.report.voxelSize, "voxels"});
  in.notes.notes.insert(in.notes.notes.end(), result.report.notes.begin(),
                        result.report.notes.end());
  if (result.report.solve.isIterative) {
    in.notes.notes.push_back(fmt::format(
        "{} particles solved for in {} iterations, residual {:.2g}", result.report.particles,
        result.report.solve.iterations, result.report.solve.solveResidual));
  }
  in.notes.notes.push_back(
      fmt::format("smallest Jacobian {:.3g}, stretch {:.3g} to {:.3g}, {} of {} blocks evaluated",
                  result.report.distortion.jacobian.least, result.report.distortion.stretch.least,
                  result.report.distortion.stretch.most, result.report.blocksEvaluated,
                  result.report.blocksTested));
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
  if (mapsMesh(in)) {
    Plan plan = in.operands[1].plan();
    plan.bounds = in.operands[2].plan().bounds;
    return plan;
  }
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

void validateTexture(const Invocation& in) {
  if (in.flag("carve") && in.flag("alone"))
    throw UsageError("texture: --carve and --alone exclude each other");
  if (in.flag("alone") && in.given("blend"))
    throw UsageError("texture: --alone has no seam to blend; leave --blend out");
  const Kind kind = in.operands[1].kind();
  if (mapsMesh(in) && kind != Kind::Mesh)
    throw UsageError("texture: --map mesh moves the vertices of a mesh; give one, or `mesh` first");
  if (!mapsMesh(in) && kind == Kind::Mesh) {
    throw UsageError(
        "texture: the texture is a mesh; turn it into a solid with `level-set`, or move its "
        "vertices with --map mesh");
  }
  std::vector<const char*> unused;
  if (in.text("map") != "rbf") unused = {"kernel", "map-tolerance", "lambda-near", "lambda-far"};
  if (mapsMesh(in)) unused.insert(unused.end(), {"carve", "alone", "blend", "voxel", "half-width"});
  for (const char* option : unused)
    if (in.given(option))
      throw UsageError(fmt::format("texture: --{} says nothing to --map {}; leave it out", option,
                                   in.text("map")));
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
      .params =
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
            .choices = {"reduced", "conforming", "spline"}},
           {.name = "spline",
            .type = ParamType::Points,
            .doc = "with --particles spline: points that its curve passes from the patch's "
                   "centre on; default: straight along the normal"},
           {.name = "fade",
            .type = ParamType::Flag,
            .doc = "with --particles spline: the surface's relief goes to nothing on the way"},
           {.name = "twist",
            .type = ParamType::Degrees,
            .doc = "of the top about the patch's axis, anticlockwise from outside",
            .fallback = "0"},
           {.name = "taper",
            .type = ParamType::Number,
            .doc = "width of the top over that of the surface",
            .fallback = "1",
            .range = Range::Positive},
           {.name = "bend",
            .type = ParamType::Degrees,
            .doc = "that the axis leans towards u at the top",
            .fallback = "0"},
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
            .choices = {"rbf", "shell", "mesh"}},
           {.name = "kernel",
            .type = ParamType::Choice,
            .doc = "with --map rbf: what a particle does at a distance",
            .fallback = "biharmonic",
            .choices = kKernelNames},
           {.name = "map-tolerance",
            .type = ParamType::Number,
            .doc = "how far the fast evaluation of the map may be off, texture voxels",
            .fallback = "0.05",
            .range = Range::NonNegative},
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
            .doc = "relaxation of the map at the surface, in mean particle spacings; for other "
                   "kernels in their own units",
            .fallback = "0.005",
            .range = Range::NonNegative},
           {.name = "lambda-far",
            .type = ParamType::Number,
            .doc = "the same above the surface",
            .fallback = "0.25",
            .range = Range::NonNegative},
           {.name = "allow-folds", .type = ParamType::Flag, .doc = "map even where the map folds"}},
      .operands = {{Kind::Band}, {Kind::Band, Kind::Mesh}, {Kind::Patch}},
      .resultKind = [](const Invocation& in) { return mapsMesh(in) ? Kind::Mesh : Kind::Band; },
      .run = texture,
      .plan = planTexture,
      .validate = validateTexture,
  });
}

}  // namespace pipeline
