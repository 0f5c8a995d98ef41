#include "apps/pipeline/operators/mapping/patch_quality_options.h"
#include "apps/pipeline/operators/declarations.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "apps/pipeline/operators/common.h"
#include "apps/process_cost.h"
#include "levelset/error.h"
#include "mapping/distortion/jacobian_field.h"
#include "mapping/maps/layer_map.h"
#include "mapping/maps/prism_map.h"
#include "mapping/placement/shared_particles.h"
#include "mapping/rbf/rbf_map.h"
#include "mapping/textures/geometric_texture.h"
#include "mapping/untangle/untangle.h"

namespace pipeline {
namespace {

using Imath::V3d;
using levelset::UsageError;

nlohmann::ordered_json spreadOf(const mapping::Spread& spread) {
  nlohmann::ordered_json json;
  json["min"] = spread.least;
  json["percent_1"] = spread.percent1;
  json["median"] = spread.median;
  json["percent_99"] = spread.percent99;
  json["max"] = spread.most;
  return json;
}

nlohmann::ordered_json foldsJson(const mapping::FoldCount& folds) {
  return {{"folded_cells", folds.folded},
          {"cells", folds.cells},
          {"min_jacobian", folds.leastJacobian}};
}

nlohmann::ordered_json energyJson(const mapping::ElementDistortion& distortion) {
  return {{"energy", distortion.mean},
          {"median", distortion.median},
          {"percent_99", distortion.percent99},
          {"max", distortion.most}};
}

const std::vector<std::string> kKernelNames = {"biharmonic", "triharmonic", "thin-plate", "sum",
                                               "laplacian",  "gaussian",    "wendland"};

bool isRelaxed(const Invocation& in) {
  return in.text("relax") != "none";
}

/// @param part, parts  index of this pass over a patch and number of all passes, for the progress
mapping::UntangleOptions shellOptions(const Invocation& in, const mapping::Patch& patch,
                                      double embedDepth, std::size_t part, std::size_t parts) {
  const auto share = [&](std::size_t n) {
    return static_cast<double>(n) / static_cast<double>(parts);
  };
  return {.embedDepth = embedDepth / patch.height,
          .freeSides = in.text("sides") == "free",
          .maxMemory = in.maxMemory,
          .progress = levelset::subProgress(in.progress, share(part), share(part + 1))};
}

void unfoldPatches(Invocation& in, const levelset::NarrowBand& base, ImprovedPatches& improved,
                   double embedDepth) {
  mapping::FoldCount before, after;
  before.leastJacobian = after.leastJacobian = HUGE_VAL;
  const std::size_t parts = improved.patches.size() * (isRelaxed(in) ? 2 : 1);
  for (mapping::Patch& patch : improved.patches) {
    const auto part = static_cast<std::size_t>(&patch - improved.patches.data());
    mapping::Untangling result =
        mapping::untangle(base, patch, shellOptions(in, patch, embedDepth, part, parts));
    improved.figures["unfold"].push_back({{"before", foldsJson(result.before)},
                                          {"after", foldsJson(result.after)},
                                          {"iterations", result.iterations},
                                          {"farthest_move", result.farthestMove}});
    before.folded += result.before.folded;
    before.cells += result.before.cells;
    before.leastJacobian = std::min(before.leastJacobian, result.before.leastJacobian);
    after.folded += result.after.folded;
    after.leastJacobian = std::min(after.leastJacobian, result.after.leastJacobian);
    patch = std::move(result.patch);
  }
  if (before.folded == 0) {
    in.notes.notes.push_back("--untangle: no cell of the patch folds, so the patch is unchanged");
  } else if (after.folded == 0) {
    in.notes.notes.push_back(
        fmt::format("--untangle: {} of {} cells folded before, none afterwards; the least Jacobian "
                    "changed from {:.3g} to {:.3g}",
                    before.folded, before.cells, before.leastJacobian, after.leastJacobian));
  } else {
    in.notes.warnings.push_back(
        fmt::format("{}: --untangle cannot remove all folds: {} of {} cells fold, {} folded "
                    "before; lower the height of the patch, let its sides move with --sides free, "
                    "or place it where the surface is flatter",
                    in.op().name, after.folded, before.cells, before.folded));
  }
}

void relaxPatches(Invocation& in, const levelset::NarrowBand& base, ImprovedPatches& improved,
                  double embedDepth, const V3d& textureSize) {
  double before = 0, after = 0, relaxed = 0;
  const std::size_t first = in.flag("untangle") ? improved.patches.size() : 0;
  const std::size_t parts = first + improved.patches.size();
  for (mapping::Patch& patch : improved.patches) {
    const auto part = first + static_cast<std::size_t>(&patch - improved.patches.data());
    mapping::UntangleOptions options = shellOptions(in, patch, embedDepth, part, parts);
    // --skip-folds leaves a folded patch out later, so it is not relaxed.
    if (in.flag("skip-folds") && mapping::countFolds(patch, options.embedDepth).folded > 0) {
      improved.figures["relax"].push_back(nullptr);
      continue;
    }
    if (in.text("relax") == "texture") options.proportions = textureSize;
    mapping::DistortionGain result = mapping::minimiseDistortion(base, patch, options);
    improved.figures["relax"].push_back({{"before", energyJson(result.before)},
                                         {"after", energyJson(result.after)},
                                         {"iterations", result.iterations},
                                         {"farthest_move", result.farthestMove}});
    before += result.before.mean;
    after += result.after.mean;
    ++relaxed;
    patch = std::move(result.patch);
  }
  if (relaxed == 0) return;
  in.notes.notes.push_back(fmt::format(
      "--relax: the energy of distortion changed from {:.6g} to {:.6g}; 6 means no distortion",
      before / relaxed, after / relaxed));
}

/// Fold certificate, distortion and Jacobian field of the map that --map names.
struct JudgedMap {
  mapping::FoldCertificate certificate;
  mapping::Distortion distortion;
  levelset::FieldGrid field;
};

JudgedMap judgeMap(Invocation& in, const mapping::Patch& patch, double embedDepth, double voxel) {
  mapping::JacobianFieldOptions options{
      .voxelSize = voxel, .embedDepth = embedDepth / patch.height, .maxMemory = in.maxMemory};
  const auto [u, v] = sidesOf(patch);  // lengths of the patch, used as the size of the texture
  const V3d size(u, v, patch.height);
  const auto survey = [&](const std::vector<mapping::MapSample>& samples) {
    return mapping::surveyDistortion(samples, size, patch.mirrored);
  };
  if (in.text("map") == "mesh") {
    mapping::FoldCertificate certificate = mapping::certifyLayers(patch, options.embedDepth);
    levelset::FieldGrid field = mapping::jacobianField(patch, certificate, options);
    return {std::move(certificate), survey(mapping::sampleLayerMap(patch, options.embedDepth)),
            std::move(field)};
  }
  if (in.text("map") == "shell") {
    levelset::requireMemory(mapping::PrismMap::estimateBytes(patch), in.maxMemory);
    const mapping::PrismMap map(patch, {.embedDepth = options.embedDepth});
    mapping::FoldCertificate certificate = mapping::certifyPrisms(map, patch.mirrored);
    levelset::FieldGrid field = mapping::jacobianField(patch, map, certificate, options);
    return {std::move(certificate), survey(map.samples()), std::move(field)};
  }
  mapping::TextureCost cost;
  mapping::CertifiedRbf judged = mapping::certifiedRbf(patch, options.embedDepth,
                                                       {.kernel = kernelOf(in),
                                                        .lambdaNear = in.number("lambda-near"),
                                                        .lambdaFar = in.number("lambda-far"),
                                                        .support = in.number("support"),
                                                        .maxMemory = in.maxMemory,
                                                        .progress = in.progress},
                                                       cost);
  if (judged.isExtrapolated)
    in.notes.notes.push_back(
        "folds: below the surface of the base, the map is extrapolated without particles, since "
        "particles that continue the columns straight would fold it");
  levelset::FieldGrid field =
      mapping::jacobianField(patch, *judged.map, judged.certificate, options);
  return {std::move(judged.certificate), survey(judged.samples), std::move(field)};
}

std::string verdictSentence(const mapping::FoldCertificate& certificate) {
  if (certificate.verdict() == mapping::FoldVerdict::Certified)
    return fmt::format("certified: the map folds nowhere, its least Jacobian is {:.3g}",
                       certificate.leastJacobian);
  if (certificate.verdict() == mapping::FoldVerdict::Undecided)
    return fmt::format("no fold was found, but a share of {:.2g} of the volume is not certified",
                       certificate.undecidedShare);
  const mapping::FoldPoint& worst = certificate.worst.front();
  return fmt::format(
      "the map folds, worst at ({:.6g}, {:.6g}, {:.6g}), where u, v, w = {:.3g}, {:.3g}, {:.3g}",
      worst.position.x, worst.position.y, worst.position.z, worst.uvw.x, worst.uvw.y, worst.uvw.z);
}

Value folds(Invocation& in) {
  const PatchValue& onto = in.operands[1].patch();
  if (onto.atHeight)
    throw UsageError(
        "folds: the patch has --height auto, and its height is unknown without a texture; give "
        "--height a length");
  if (onto.patches.size() != 1)
    throw UsageError(
        fmt::format("folds: the operand has {} patches; give a single patch", onto.patches.size()));
  const double embedDepth = in.length("embed");
  const double voxel = in.given("voxel") ? in.length("voxel") : in.band(0).voxelSize();
  // Without a texture, the patch is relaxed towards its own proportions.
  ImprovedPatches improved = improvedPatches(in, in.band(0), onto.patches, embedDepth, V3d(1));
  JudgedMap judged = judgeMap(in, improved.patches.front(), embedDepth, voxel);
  nlohmann::ordered_json json = std::move(improved.figures);
  addDistortion(judged.distortion, json);
  json["certificate"] = certificateJson(judged.certificate);
  in.notes.detailsJson = json.dump();
  in.notes.notes.push_back(verdictSentence(judged.certificate));
  return Value(std::move(judged.field));
}

Plan planFolds(Invocation& in) {
  const Plan &base = in.operands[0].plan(), &patch = in.operands[1].plan();
  Plan plan;
  plan.kind = Kind::Field;
  plan.bounds = patch.bounds;
  plan.voxelSize = in.given("voxel") ? in.length("voxel") : base.voxelSize;
  const V3d& size = patch.patchSize;
  constexpr double kBytesPerVoxel = 8;
  plan.fieldBytes = plan.voxelSize > 0 ? kBytesPerVoxel * size.x * size.y * size.z /
                                             (plan.voxelSize * plan.voxelSize * plan.voxelSize)
                                       : 0;
  return plan;
}

void validateFolds(const Invocation& in) {
  validateShell(in);
  if (in.text("relax") == "texture")
    throw UsageError("folds: --relax texture needs a texture; give --relax patch");
  validateKernel(in);
}

}  // namespace

std::array<double, 2> sidesOf(const mapping::Patch& patch) {
  const mapping::ParticleLayer& layer = patch.layers.front();
  double u = 0, v = 0;
  for (std::size_t row = 0; row < layer.rows; ++row)
    for (std::size_t column = 1; column < layer.columns; ++column)
      u += (layer.at(column, row) - layer.at(column - 1, row)).length();
  for (std::size_t column = 0; column < layer.columns; ++column)
    for (std::size_t row = 1; row < layer.rows; ++row)
      v += (layer.at(column, row) - layer.at(column, row - 1)).length();
  return {u / static_cast<double>(layer.rows), v / static_cast<double>(layer.columns)};
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

Param kernelParam() {
  return {.name = "kernel",
          .type = ParamType::Choice,
          .doc =
              "with --map rbf: radial basis function, the influence of a particle as a function of "
              "distance",
          .fallback = "biharmonic",
          .choices = kKernelNames};
}

Param supportParam() {
  return {.name = "support",
          .type = ParamType::Number,
          .doc =
              "with --kernel wendland: distance beyond which a particle has no influence, in mean "
              "particle spacings, more than 1",
          .fallback = "4",
          .range = Range::Positive};
}

void validateKernel(const Invocation& in) {
  for (const char* option : {"kernel", "support", "lambda-near", "lambda-far"})
    if (in.text("map") != "rbf" && in.given(option))
      throw UsageError(fmt::format("{}: --{} has no effect with --map {}; leave it out",
                                   in.op().name, option, in.text("map")));
  if (in.given("support") && !levelset::rbf::isCompact(kernelOf(in)))
    throw UsageError(fmt::format("{}: --support has no effect with --kernel {}; leave it out",
                                 in.op().name, in.text("kernel")));
}

mapping::RbfKernel kernelOf(const Invocation& in) {
  const auto name = std::find(kKernelNames.begin(), kKernelNames.end(), in.text("kernel"));
  return static_cast<mapping::RbfKernel>(name - kKernelNames.begin());
}

std::vector<Param> withShell(std::vector<Param> params) {
  params.push_back({.name = "untangle",
                    .type = ParamType::Flag,
                    .doc = "move particles of the patch until none of the cells between them folds",
                    .formerName = "unfold"});
  params.push_back({.name = "relax",
                    .type = ParamType::Choice,
                    .doc = "move particles so that the map has the least distortion, relative to "
                           "the proportions of the patch or of the texture",
                    .fallback = "none",
                    .choices = {"none", "patch", "texture"}});
  params.push_back({.name = "sides",
                    .type = ParamType::Choice,
                    .doc = "with --untangle or --relax: particles on the sides of the patch stay "
                           "fixed, or slide on the surface",
                    .fallback = "fixed",
                    .choices = {"fixed", "free"}});
  return params;
}

bool improvesPatches(const Invocation& in) {
  return in.flag("untangle") || isRelaxed(in);
}

void validateShell(const Invocation& in) {
  if (in.given("sides") && !improvesPatches(in))
    throw UsageError(
        fmt::format("{}: --sides needs --untangle or --relax; leave it out, or give one of them",
                    in.op().name));
}

ImprovedPatches improvedPatches(Invocation& in, const levelset::NarrowBand& base,
                                std::vector<mapping::Patch> patches, double embedDepth,
                                const V3d& textureSize) {
  for (const mapping::Patch& patch : patches) mapping::requirePatchOn(base, patch);
  ImprovedPatches improved{.patches = std::move(patches)};
  if (!improvesPatches(in)) return improved;
  const double start = apps::processCpuSeconds();
  const std::vector<mapping::Patch> before = improved.patches;
  if (in.flag("untangle")) unfoldPatches(in, base, improved, embedDepth);
  if (isRelaxed(in)) relaxPatches(in, base, improved, embedDepth, textureSize);
  mapping::joinSharedParticles(before, improved.patches);
  improved.figures["improvement_cpu_s"] = apps::processCpuSeconds() - start;
  return improved;
}

nlohmann::ordered_json certificateJson(const mapping::FoldCertificate& certificate) {
  nlohmann::ordered_json json;
  json["verdict"] = mapping::foldVerdictName(certificate.verdict());
  json["min_jacobian"] = certificate.leastJacobian;
  json["folded_share"] = certificate.foldedShare;
  json["undecided_share"] = certificate.undecidedShare;
  json["pieces"] = certificate.pieces;
  json["worst"] = nlohmann::ordered_json::array();
  for (const mapping::FoldPoint& fold : certificate.worst)
    json["worst"].push_back({{"place", {fold.position.x, fold.position.y, fold.position.z}},
                             {"uvw", {fold.uvw.x, fold.uvw.y, fold.uvw.z}},
                             {"jacobian", fold.jacobian}});
  return json;
}

Operator foldsOperator() {
  return {
      .name = "folds",
      .group = "Texture mapping",
      .summary = "certify that a patch's map does not fold, and compute its Jacobian as a field",
      .details =
          "The operands are base and patch. The field holds the map's Jacobian on the grid points "
          "of the patch: 1 at the median, 0 or less where the map folds. The report gives the fold "
          "certificate, and percentiles of the stretch and the Jacobian relative to the patch's "
          "own size.",
      .example =
          "levelsmith sphere --radius 10 --voxel 0.5 --as ball ! patch @ball --at 0,0,10 "
          "--size 8,8 --height 3 --as p ! folds @ball @p ! write jacobian.vdb",
      .params = withShell(
          {{.name = "map",
            .type = ParamType::Choice,
            .doc = "map to certify: rbf, smooth, by radial basis functions; shell, piecewise "
                   "linear between the particles; mesh, the map that moves vertices of a mesh",
            .fallback = "rbf",
            .choices = {"rbf", "shell", "mesh"}},
           {.name = "embed",
            .type = ParamType::Length,
            .doc = "depth below the surface of the base to which the map is tested",
            .fallback = "1vx",
            .range = Range::NonNegative,
            .formerName = "sink"},
           voxelParam("voxel size of the field; default: that of the base"),
           kernelParam(),
           supportParam(),
           {.name = "lambda-near",
            .type = ParamType::Number,
            .doc = "with --map rbf: smoothing of the map at particles on the surface, in mean "
                   "particle spacings (for kernels other than biharmonic, in units of the kernel); "
                   "0: none",
            .fallback = "0.005",
            .range = Range::NonNegative},
           {.name = "lambda-far",
            .type = ParamType::Number,
            .doc = "with --map rbf: smoothing of the map at particles above the surface, in the "
                   "unit of --lambda-near; 0: none",
            .fallback = "0.25",
            .range = Range::NonNegative}}),
      .operands = {{Kind::Band, Kind::Surface}, {Kind::Patch}},
      .resultKind = [](const Invocation&) { return Kind::Field; },
      .run = folds,
      .plan = planFolds,
      .validate = validateFolds,
  };
}

}  // namespace pipeline
