#include <fmt/core.h>

#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/mapping/patch_quality_options.h"
#include "apps/pipeline/operators/mapping/texture_options.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "mapping/patches/patch.h"
#include "mapping/textures/geometric_texture.h"
#include "mapping/textures/mesh_texture.h"
#include "mapping/textures/texture_shells.h"
#include "render/views/scene_file.h"

namespace pipeline {
namespace {

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

nlohmann::ordered_json costJson(const mapping::TextureCost& cost) {
  nlohmann::ordered_json json;
  json["setup"] = cost.setup;
  json["certificate"] = cost.certificate;
  json["mapping"] = cost.mapping;
  json["distance"] = cost.distance;
  json["merging"] = cost.merging;
  return json;
}

std::string detailsOf(const mapping::TextureReport& report, double height, bool isRbf,
                      const nlohmann::ordered_json& improvement) {
  nlohmann::ordered_json json;
  json["voxel_size"] = report.voxelSize;
  json["patches"] = report.patches;
  json["skipped"] = report.skipped;
  json["height"] = height;
  json["particles"] = report.particles;
  json["blocks_tested"] = report.blocksTested;
  json["blocks_evaluated"] = report.blocksEvaluated;
  json["operations_per_point"] = report.operationsPerPoint;
  json["cpu_s"] = costJson(report.cost);
  addDistortion(report.distortion, json);
  json["map_residual"] = report.mapResidual;
  json["map_error"] = report.mapError;
  json["map_error_points"] = report.mapErrorPoints;
  if (isRbf) addSolve(report.solve, json);
  json["certificate"] = certificateJson(report.certificate);
  json.update(improvement);
  return json.dump();
}

std::size_t particlesOf(std::span<const mapping::Patch> patches) {
  std::size_t particles = 0;
  for (const mapping::Patch& patch : patches) particles += patch.particleCount();
  return particles;
}

/// Returns the patches of the operand after --untangle and --relax.
ImprovedPatches patchesFor(Invocation& in, const Imath::Box3d& textureBox) {
  return improvedPatches(in, in.band(0), patchesAtHeight(in, in.operands[2].patch(), textureBox),
                         in.length("embed"), textureBox.size());
}

Value textureMesh(Invocation& in) {
  const ImprovedPatches improved = patchesFor(in, textureBoxOf(in));
  const std::vector<mapping::Patch>& patches = improved.patches;
  mapping::MeshTextureOptions options = meshTextureOptions(in);
  options.progress = in.progress;
  for (const mapping::Patch& patch : patches) mapping::requirePatchOn(in.band(0), patch);
  mapping::MeshTextureResult result = mapping::mapMesh(in.mesh(1), patches, options);
  nlohmann::ordered_json json;
  json["patches"] = patches.size();
  json["skipped"] = result.skipped;
  json["height"] = patches.front().height;
  json["particles"] = particlesOf(patches);
  addDistortion(result.distortion, json);
  json["certificate"] = certificateJson(result.certificate);
  json.update(improved.figures);
  in.notes.detailsJson = json.dump();
  in.notes.notes.insert(in.notes.notes.end(), result.notes.begin(), result.notes.end());
  in.notes.notes.push_back(fmt::format("{} vertices moved, smallest Jacobian {:.3g}",
                                       result.mesh.positions.size(),
                                       result.distortion.jacobian.least));
  return Value(std::move(result.mesh));
}

/// Reports the error of the map's fast evaluation at the points where the map was also evaluated
/// directly. Warns if it exceeds the tolerance.
/// @param tolerance  --map-tolerance, texture voxels
void tellMapError(Invocation& in, const mapping::TextureReport& report, double tolerance) {
  if (report.mapErrorPoints == 0) return;
  in.notes.errors.push_back(
      {fmt::format("largest error of the map's fast evaluation at {} random points",
                   report.mapErrorPoints),
       report.mapError, "texture voxels"});
  constexpr double kRounding = 1e-6;
  if (report.mapError > tolerance + kRounding) {
    in.notes.warnings.push_back(
        fmt::format("{}: the map's fast evaluation has an error of {:.3g} texture voxels, more "
                    "than the requested {}; this is a defect, please report it",
                    in.op().name, report.mapError, tolerance));
  }
}

render::PrismShell shellOf(mapping::TextureShell shell) {
  return {.cells = shell.cells,
          .coordinates = std::move(shell.coordinates),
          .centre = shell.centre,
          .offsets = std::move(shell.offsets)};
}

/// Returns a scene of the base and the texture in a shell for each patch. Base and textures count
/// as one solid, with one id and colour, as if they were merged.
Value textureInstances(Invocation& in) {
  mapping::TextureOptions options = textureOptions(in);
  options.progress = in.progress;
  const ImprovedPatches improved = patchesFor(in, textureBoxOf(in));
  mapping::PlacedTexture placed =
      mapping::placeTexture(in.band(0), in.band(1), improved.patches, options);
  render::ViewedScene viewed;
  if (!in.flag("alone")) viewed.scene.solids.push_back({.band = in.band(0), .name = "base"});
  std::size_t shellBytes = 0;
  for (mapping::ShellGroup& group : placed.groups) {
    std::vector<render::PrismShell> shells;
    shells.reserve(group.shells.size());
    for (mapping::TextureShell& shell : group.shells) {
      shellBytes += sizeof(shell) + shell.offsets.size() * sizeof(shell.offsets[0]);
      for (const std::vector<double>& along : shell.coordinates)
        shellBytes += along.size() * sizeof(double);
      shells.push_back(shellOf(std::move(shell)));
    }
    viewed.scene.mapped.push_back(
        {.band = group.texture,
         .shells = std::make_shared<const std::vector<render::PrismShell>>(std::move(shells)),
         .name = fmt::format("texture{}", viewed.scene.mapped.size() + 1)});
  }
  const mapping::TextureReport& report = placed.report;
  nlohmann::ordered_json json;
  json["patches"] = report.patches;
  json["skipped"] = report.skipped;
  json["height"] = improved.patches.front().height;
  json["particles"] = report.particles;
  json["shell_bytes"] = shellBytes;
  json["cpu_s"] = costJson(report.cost);
  addDistortion(report.distortion, json);
  json["certificate"] = certificateJson(report.certificate);
  json.update(improved.figures);
  in.notes.detailsJson = json.dump();
  in.notes.notes.insert(in.notes.notes.end(), report.notes.begin(), report.notes.end());
  in.notes.notes.push_back(fmt::format(
      "the texture is kept once, in {} shells of {:.3g} MB; smallest Jacobian {:.3g}",
      report.patches, static_cast<double>(shellBytes) / 1e6, report.distortion.jacobian.least));
  return Value(std::move(viewed));
}

Value texture(Invocation& in) {
  if (in.flag("instances")) return textureInstances(in);
  if (mapsMesh(in)) return textureMesh(in);
  mapping::TextureOptions options = textureOptions(in);
  options.progress = in.progress;
  const ImprovedPatches improved = patchesFor(in, textureBoxOf(in));
  const std::vector<mapping::Patch>& patches = improved.patches;
  mapping::TextureResult result = mapping::mapTexture(in.band(0), in.band(1), patches, options);
  in.notes.detailsJson = detailsOf(result.report, patches.front().height,
                                   options.map == mapping::TextureMap::Rbf, improved.figures);
  in.notes.errors.push_back({"largest residual of the map at particles",
                             result.report.mapResidual / result.report.voxelSize, "voxels"});
  tellMapError(in, result.report, options.mapTolerance);
  in.notes.notes.insert(in.notes.notes.end(), result.report.notes.begin(),
                        result.report.notes.end());
  if (result.report.solve.isIterative) {
    in.notes.notes.push_back(
        fmt::format("the map through {} particles was solved in {} iterations, residual {:.2g}",
                    result.report.particles, result.report.solve.iterations,
                    result.report.solve.solveResidual));
  }
  in.notes.notes.push_back(
      fmt::format("smallest Jacobian {:.3g}, stretch {:.3g} to {:.3g}, {} of {} blocks evaluated",
                  result.report.distortion.jacobian.least, result.report.distortion.stretch.least,
                  result.report.distortion.stretch.most, result.report.blocksEvaluated,
                  result.report.blocksTested));
  return Value(std::move(result.band));
}

Kind resultOfTexture(const Invocation& in) {
  if (in.flag("instances")) return Kind::Scene;
  return mapsMesh(in) ? Kind::Mesh : Kind::Band;
}

Plan planTextureOrScene(Invocation& in) {
  if (!in.flag("instances")) return planTexture(in);
  Plan plan = in.operands[0].plan();
  plan.kind = Kind::Scene;
  plan.bounds.extendBy(in.operands[2].plan().bounds);
  return plan;
}

void validateTexture(const Invocation& in) {
  if (in.flag("instances")) {
    if (in.text("map") != "shell" || in.operands[1].kind() == Kind::Mesh)
      throw levelset::UsageError(
          "texture: --instances needs a solid as texture and the piecewise linear map; give --map "
          "shell");
    for (const char* option : {"carve", "blend", "voxel", "half-width"})
      if (in.given(option))
        throw levelset::UsageError(
            fmt::format("texture: --instances makes no merged grid, so --{} has no effect; leave "
                        "one of them out",
                        option));
  }
  validateTextureOptions(in);
}

std::vector<Param> paramsOfTexture() {
  std::vector<Param> params = textureParams();
  params.push_back({.name = "instances",
                    .type = ParamType::Flag,
                    .doc = "with --map shell: return a scene of the base and the texture, kept "
                           "once and mapped when 'render' draws it, in place of a merged solid"});
  return params;
}

}  // namespace

Operator textureOperator() {
  return {
      .name = "texture",
      .group = "Texture mapping",
      .summary = "map a solid onto a patch of a surface, and join the two",
      .details =
          "The operands are base, texture and patch. The box of the texture's zero set is the unit "
          "cube of u, v, w. A map that folds is an error, whose message gives the position of the "
          "fold. With --instances the result is a scene for 'render'. It needs a small part of the "
          "memory of a merged solid.",
      .example =
          "levelsmith box --size 40,40,10 --voxel 0.5 --as base ! torus --radius 4 --tube "
          "1.5 --voxel 0.25 --as rings "
          "! patch @base --corners \"-10,-10,5 10,-10,5 10,10,5 -10,10,5\" --height 8 "
          "--layers 6 --as p "
          "! texture @base @rings @p --map rbf --blend 1 ! write out.vdb ! mesh ! write out.ply",
      .params = paramsOfTexture(),
      .operands = {{Kind::Band, Kind::Surface}, {Kind::Band, Kind::Mesh}, {Kind::Patch}},
      .resultKind = resultOfTexture,
      .run = texture,
      .plan = planTextureOrScene,
      .validate = validateTexture,
  };
}

}  // namespace pipeline
