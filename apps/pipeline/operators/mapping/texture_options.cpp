#include "apps/pipeline/operators/mapping/texture_options.h"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <span>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/mapping/patch_quality_options.h"
#include "levelset/error.h"

namespace pipeline {
namespace {

using Imath::V3d;
using levelset::UsageError;

/// Returns the height, world units, that keeps the texture's proportions on patches of this size;
/// the mean over all patches.
double aspectHeight(std::span<const mapping::Patch> patches, const Imath::Box3d& textureBox) {
  const V3d size = textureBox.size();
  double sum = 0;
  for (const mapping::Patch& patch : patches) {
    const auto [u, v] = sidesOf(patch);
    sum += size.z * std::sqrt(u / size.x * v / size.y);
  }
  return sum / static_cast<double>(patches.size());
}

/// Estimates the smallest stretch of the map before the map exists: the smallest ratio of the
/// patch's size to the texture's box along u, v and w; 1 if no size is known.
double plannedStretch(const Invocation& in, const Plan& texture, const Plan& patch) {
  const V3d box = in.given("texture-box") ? in.box("texture-box").size() : texture.bounds.size();
  double stretch = HUGE_VAL;
  for (int axis = 0; axis < 3; ++axis)
    if (patch.patchSize[axis] > 0 && box[axis] > 0)
      stretch = std::min(stretch, patch.patchSize[axis] / box[axis]);
  return std::isfinite(stretch) ? stretch : 1;
}

}  // namespace

bool mapsMesh(const Invocation& in) {
  return in.text("map") == "mesh" ||
         (in.text("map") == "shell" && in.operands[1].kind() == Kind::Mesh);
}

Imath::Box3d textureBoxOf(const Invocation& in) {
  return in.given("texture-box") ? in.box("texture-box") : in.operands[1].plan().bounds;
}

std::vector<mapping::Patch> patchesAtHeight(Invocation& in, const PatchValue& onto,
                                            const Imath::Box3d& textureBox) {
  if (!onto.atHeight) return onto.patches;
  const double height = aspectHeight(onto.patches, textureBox);
  in.notes.notes.push_back(
      fmt::format("--height auto: {:.6g} keeps the texture's proportions", height));
  return onto.atHeight(height, in.progress);
}

mapping::TextureOptions textureOptions(Invocation& in) {
  mapping::TextureOptions options;
  if (in.flag("carve")) options.merge = mapping::TextureMerge::Carve;
  if (in.flag("alone")) options.merge = mapping::TextureMerge::Alone;
  options.embedDepth = in.length("embed");
  options.blend = in.length("blend");
  if (in.given("texture-box")) options.textureBox = in.box("texture-box");
  if (in.given("voxel")) options.voxelSize = in.length("voxel");
  options.halfWidth = in.number("half-width");
  if (in.text("map") == "shell") options.map = mapping::TextureMap::Prism;
  options.mapTolerance = in.number("map-tolerance");
  options.rbf.kernel = kernelOf(in);
  options.rbf.support = in.number("support");
  options.rbf.lambdaNear = in.number("lambda-near");
  options.rbf.lambdaFar = in.number("lambda-far");
  options.allowFolds = in.flag("allow-folds");
  options.skipFolds = in.flag("skip-folds");
  options.maxMemory = in.maxMemory;
  return options;
}

mapping::MeshTextureOptions meshTextureOptions(Invocation& in) {
  mapping::MeshTextureOptions options;
  if (in.text("map") == "shell") options.map = mapping::MeshMap::Prisms;
  options.embedDepth = in.length("embed");
  if (in.given("texture-box")) options.textureBox = in.box("texture-box");
  options.allowFolds = in.flag("allow-folds");
  options.skipFolds = in.flag("skip-folds");
  options.maxMemory = in.maxMemory;
  return options;
}

Plan planTexture(Invocation& in) {
  if (mapsMesh(in)) {
    Plan plan = in.operands[1].plan();
    plan.bounds = in.operands[2].plan().bounds;
    return plan;
  }
  Plan plan = in.operands[0].plan();
  plan.kind = Kind::Band;
  const Plan &texture = in.operands[1].plan(), &patch = in.operands[2].plan();
  plan.voxelSize = in.given("voxel") ? in.length("voxel")
                                     : mapping::resultVoxelSize(plan.voxelSize, texture.voxelSize,
                                                                plannedStretch(in, texture, patch));
  const double from = texture.bounds.size().length();
  const double to = (patch.patchCount > 1 ? patch.patchSize : patch.bounds.size()).length();
  const double scale = from > 0 ? to / from : 1;
  plan.area = (in.flag("alone") ? 0 : plan.area) + patch.patchCount * texture.area * scale * scale;
  plan.bounds.extendBy(patch.bounds);
  return plan;
}

void validateTextureOptions(const Invocation& in) {
  validateShell(in);
  if (in.flag("carve") && in.flag("alone"))
    throw UsageError(in.op().name + ": --carve and --alone exclude each other");
  if (in.flag("allow-folds") && in.flag("skip-folds"))
    throw UsageError(in.op().name + ": --allow-folds and --skip-folds exclude each other");
  if (in.operands[0].kind() == Kind::Surface && !mapsMesh(in) && !in.flag("alone"))
    throw UsageError(in.op().name +
                     ": the base is a surface band, which has no inside to join the texture to; "
                     "give --alone for the texture only, or move a mesh with --map mesh or --map "
                     "shell");
  if (in.flag("alone") && in.given("blend"))
    throw UsageError(in.op().name + ": --alone has no seam to blend; leave --blend out");
  const Kind kind = in.operands[1].kind();
  if (mapsMesh(in) && kind != Kind::Mesh)
    throw UsageError(in.op().name +
                     ": --map mesh needs a mesh as texture; put `mesh` after the level set");
  if (!mapsMesh(in) && kind == Kind::Mesh) {
    throw UsageError(in.op().name +
                     ": the texture is a mesh; turn it into a solid with `level-set`, or move its "
                     "vertices with --map mesh or --map shell");
  }
  std::vector<const char*> unused;
  validateKernel(in);
  if (in.text("map") != "rbf") unused = {"map-tolerance"};
  if (mapsMesh(in)) unused.insert(unused.end(), {"carve", "alone", "blend", "voxel", "half-width"});
  for (const char* option : unused)
    if (in.given(option))
      throw UsageError(fmt::format("{}: --{} has no effect with --map {}{}; leave it out",
                                   in.op().name, option, in.text("map"),
                                   mapsMesh(in) && in.text("map") == "shell" ? " and a mesh" : ""));
}

std::vector<Param> textureParams() {
  return withShell(
      {{.name = "map",
        .type = ParamType::Choice,
        .doc = "map from the space above the patch to the texture: rbf, smooth, by radial basis "
               "functions; shell, piecewise linear between the particles, also moves the vertices "
               "of a mesh; mesh, moves them by interpolation within the layers",
        .fallback = "rbf",
        .choices = {"rbf", "shell", "mesh"}},
       kernelParam(),
       supportParam(),
       {.name = "map-tolerance",
        .type = ParamType::Number,
        .doc = "with --map rbf: largest error of the fast evaluation of the map, in texture voxels",
        .fallback = "0.05",
        .range = Range::NonNegative},
       {.name = "embed",
        .type = ParamType::Length,
        .doc = "depth by which the texture reaches below the surface of the base, so that the two "
               "connect",
        .fallback = "1vx",
        .range = Range::NonNegative,
        .formerName = "sink"},
       {.name = "blend",
        .type = ParamType::Length,
        .doc = "radius of the rounding along the seam of texture and base; 0: none",
        .fallback = "0",
        .range = Range::NonNegative},
       {.name = "carve",
        .type = ParamType::Flag,
        .doc = "subtract the texture from the base, in place of adding it"},
       {.name = "alone",
        .type = ParamType::Flag,
        .doc = "return the mapped texture without the base"},
       {.name = "texture-box",
        .type = ParamType::Box,
        .doc = "box of the texture that is mapped onto the patch; default: the bounding box of the "
               "texture"},
       voxelParam("voxel size of the result; default: that of the base, or that of the texture "
                  "times the smallest stretch if this is smaller"),
       halfWidthParam(),
       {.name = "lambda-near",
        .type = ParamType::Number,
        .doc = "with --map rbf: smoothing of the map at particles on the surface, in mean particle "
               "spacings (for kernels other than biharmonic, in units of the kernel); 0: none",
        .fallback = "0.005",
        .range = Range::NonNegative},
       {.name = "lambda-far",
        .type = ParamType::Number,
        .doc = "with --map rbf: smoothing of the map at particles above the surface, in the unit "
               "of --lambda-near; 0: none",
        .fallback = "0.25",
        .range = Range::NonNegative},
       {.name = "allow-folds",
        .type = ParamType::Flag,
        .doc = "accept a map that folds, in place of an error"},
       {.name = "skip-folds",
        .type = ParamType::Flag,
        .doc = "leave out patches whose map folds, in place of an error"}});
}

}  // namespace pipeline
