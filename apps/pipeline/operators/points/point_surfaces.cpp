#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <utility>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/operators/level_set_operator.h"
#include "apps/pipeline/operators/solids/adaptive_actions.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/convert/mesh_to_band.h"
#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/points/surface/particles.h"
#include "levelset/points/surface/points_to_band.h"

namespace pipeline {
namespace {

using levelset::PointMethod;
using levelset::PointsToBandOptions;
using levelset::SupportCertificate;
using levelset::UsageError;

bool takesPoints(const Invocation& in) {
  return !in.operands.empty() && in.operands[0].kind() == Kind::Points;
}

PointMethod methodOf(const Invocation& in) {
  const std::string word = in.text("method");
  if (word == "meshless") return PointMethod::Meshless;
  if (word == "rbf") return PointMethod::RadialBasis;
  return word == "mpu" ? PointMethod::MultilevelPartition : PointMethod::MovingLeastSquares;
}

std::string certificateJson(const SupportCertificate& c) {
  return Json{{"points", c.points},
              {"centres", c.centres},
              {"spacing", c.medianSpacing},
              {"area", c.area},
              {"unsupported_share", c.unsupportedShare()},
              {"largest_gap", c.largestGap},
              {"mean_residual", c.meanResidual},
              {"far_points", c.farPoints},
              {"dropped_parts", c.droppedParts},
              {"opposed_share", c.opposedShare}}
      .dump();
}

levelset::ParticleKernel kernelOf(const Invocation& in) {
  const std::string word = in.text("kernel");
  if (word == "balls") return levelset::ParticleKernel::Balls;
  if (word == "blobs") return levelset::ParticleKernel::Blobs;
  return word == "zhu-bridson" ? levelset::ParticleKernel::ZhuBridson
                               : levelset::ParticleKernel::Anisotropic;
}

bool isOfParticles(const Invocation& in) {
  return in.text("method") == "particles";
}

Value surfaceOfParticles(Invocation& in, double voxelSize) {
  return Value(particlesToBand(in.operands[0].cloud(), voxelSize,
                               {.kernel = kernelOf(in),
                                .radius = in.given("radius") ? in.length("radius") : 0,
                                .reach = in.number("reach"),
                                .halfWidth = in.number("half-width"),
                                .maxMemory = in.maxMemory,
                                .progress = in.progress}));
}

Value surfaceOfPoints(Invocation& in) {
  const levelset::PointCloud& cloud = in.operands[0].cloud();
  const double voxelSize = in.voxelSize(in.operands[0].plan().estimate().longestSide());
  if (isOfParticles(in)) return surfaceOfParticles(in, voxelSize);
  const PointsToBandOptions options{
      .method = methodOf(in),
      .neighbours = in.given("neighbours") ? in.integerAs<std::size_t>("neighbours") : 0,
      .tolerance = in.number("fit-error"),
      .lambda = in.number("lambda"),
      .halfWidth = in.number("half-width"),
      .acceptUnsupported = in.flag("accept-sign"),
      .maxMemory = in.maxMemory,
      .progress = in.progress,
      .onCertificate = [&in](const SupportCertificate& certificate) {
        in.notes.certificateJson = certificateJson(certificate);
        in.notes.notes.push_back(describe(certificate));
        if (certificate.unsupportedShare() > levelset::kUnsupportedLimit)
          in.notes.warnings.push_back(
              fmt::format("{:.2g} % of the surface is a guess, since no point lies near it",
                          100 * certificate.unsupportedShare()));
      }};
  levelset::PointsToBandResult result = levelset::pointsToBand(cloud, voxelSize, options);
  if (in.given("support")) levelset::writeField(in.text("support"), result.support);
  return Value(std::move(result.band));
}

/// Values of --method for point clouds. The others are for meshes.
constexpr std::array kCloudMethods = {"mls", "mpu", "meshless", "rbf", "particles"};

/// Refuses a method of the other kind of operand.
void checkMethod(const Invocation& in) {
  if (!in.given("method") || in.operands.empty()) return;
  const std::string word = in.text("method");
  const bool isOfPoints =
      std::find(kCloudMethods.begin(), kCloudMethods.end(), word) != kCloudMethods.end();
  if (isOfPoints == takesPoints(in)) return;
  throw UsageError(
      fmt::format("level-set: --method {} is for {}, but the operand is a {}; {}", word,
                  isOfPoints ? "point clouds" : "meshes", isOfPoints ? "mesh" : "point cloud",
                  isOfPoints ? "choose blocks or prism" : "choose mls or another one"));
}

/// Options that the other kind of operand has.
void refuseOptions(const Invocation& in, std::initializer_list<const char*> names, const char* have,
                   const char* operand) {
  for (const char* name : names)
    if (in.given(name))
      throw UsageError(fmt::format(
          "level-set: --{} is for {}, but the operand is a {}; leave it out", name, have, operand));
}

std::optional<Cost> costOfPoints(Invocation& in) {
  const double points = in.operands[0].plan().points;
  if (!(points > 0) || !in.planned) return std::nullopt;
  // Grid points are sampled in blocks that reach about seven voxels to each side.
  const double samples = 14 * in.planned->estimate().layer();
  // A radial function is solved several times, with most points as centres in the worst case.
  const bool isRadial = in.text("method") == "rbf";
  return Cost{1e-9 * ((isRadial ? 8e6 : 6000) * points + 3000 * samples),
              (isRadial ? 16000 : 500) * points + 40 * samples};
}

}  // namespace

Operator conversionOperator() {
  using Conversion = levelset::LevelSetOperator;
  const Operator ofMeshes = levelSetOperator<Conversion>();
  Operator op = ofMeshes;
  op.summary = "turn a mesh or a point cloud into a level set with exact distances";
  op.details +=
      " A point cloud needs normals, see 'normals'. --method mls fits a quadratic height function "
      "to the points near each position. It smooths noise; raise --neighbours if the noise exceeds "
      "the spacing. --method mpu blends such functions of the cells of an octree, and keeps sharp "
      "edges. --method meshless blends planes through the points. --method rbf sums a radial "
      "function of each of a part of the points. It bridges gaps of several spacings. It is the "
      "most accurate one on smooth shapes with few points, and the slowest. Far from the points, "
      "the winding number decides on the side, and closes holes. The certificate in the report "
      "states which "
      "share of the surface is a guess, since no point lies within two spacings. Above 1 % this is "
      "an error without --accept-sign. --method particles makes the surface of a fluid. It takes "
      "points inside a volume, without normals.";
  op.operands = {{Kind::Mesh, Kind::Points}};
  for (Param& param : op.params)
    if (param.name == "accept-sign")
      param.doc =
          "accept a mesh whose inside is ambiguous, or that has no inside, or points whose surface "
          "is a guess in large parts";
  for (Param& param : op.params)
    if (param.name == "method") {
      param.doc =
          "with a mesh: algorithm of the distances, which are the same; blocks excludes triangles "
          "for each block of grid points, prism scans a prism around each triangle. With a point "
          "cloud: surface through the points, by default mls";
      param.choices.insert(param.choices.end(), kCloudMethods.begin(), kCloudMethods.end());
    }
  op.params.push_back({.name = "neighbours",
                       .type = ParamType::Integer,
                       .doc =
                           "number of points that determine the surface at a position, 6 to 1000; "
                           "default: 16 for mls, 15 for mpu, 12 for meshless",
                       .range = Range::Positive});
  op.params.push_back(
      {.name = "fit-error",
       .type = ParamType::Number,
       .doc = "with --method mpu and rbf: aimed distance of the points from the surface, "
              "in point spacings",
       .fallback = "0.02",
       .range = Range::Positive});
  op.params.push_back({.name = "lambda",
                       .type = ParamType::Number,
                       .doc =
                           "with --method rbf: smoothing, in mean distances between the particles "
                           "of the function; 0 interpolates",
                       .fallback = "0",
                       .range = Range::NonNegative});
  op.params.push_back(
      {.name = "support",
       .type = ParamType::Path,
       .doc = "write the distances from the surface to the nearest point, in spacings, to this "
              ".vdb"});
  op.params.push_back({.name = "kernel",
                       .type = ParamType::Choice,
                       .doc = "with --method particles: union of balls; sum of Gaussians; ball of "
                              "averages; or sum of kernels that are flattened like their "
                              "neighbourhood, which gives the smoothest surface",
                       .fallback = "anisotropic",
                       .choices = {"balls", "blobs", "zhu-bridson", "anisotropic"}});
  op.params.push_back({.name = "radius",
                       .type = ParamType::Length,
                       .doc =
                           "with --method particles: radius of a particle; default: the radii of "
                           "the cloud, or 0.8 times the median distance between neighbours",
                       .range = Range::Positive,
                       .allowsVoxels = false});
  op.params.push_back(
      {.name = "reach",
       .type = ParamType::Number,
       .doc = "with --method particles: reach of a particle in its radii, 1.5 to 10",
       .fallback = "3",
       .range = Range::Positive});
  op.run = [ofMeshes](Invocation& in) {
    return takesPoints(in) ? surfaceOfPoints(in) : ofMeshes.run(in);
  };
  op.cost = [ofMeshes](Invocation& in) {
    return takesPoints(in) ? costOfPoints(in) : ofMeshes.cost(in);
  };
  op.targets = [](const Invocation& in) {
    return in.given("support") ? std::vector<std::string>{in.text("support")}
                               : std::vector<std::string>{};
  };
  op.validate = [ofMeshes](const Invocation& in) {
    ofMeshes.validate(in);
    checkMethod(in);
    if (takesPoints(in)) {
      refuseOptions(in, {"sign", "nested", "skip-intersection-test"}, "meshes", "point cloud");
      for (const char* name : {"kernel", "radius", "reach"})
        if (in.given(name) && !isOfParticles(in))
          throw UsageError(
              fmt::format("level-set: --{} needs --method particles; leave it out", name));
      const std::string method = in.text("method");
      if (in.given("fit-error") && method != "mpu" && method != "rbf")
        throw UsageError("level-set: --fit-error needs --method mpu or rbf; leave it out");
      if (in.given("lambda") && method != "rbf")
        throw UsageError("level-set: --lambda needs --method rbf; leave it out");
      if (in.given("support") && isOfParticles(in))
        throw UsageError("level-set: --support does not apply to --method particles; leave it out");
      if (in.given("neighbours") && (isOfParticles(in) || method == "rbf"))
        throw UsageError(fmt::format(
            "level-set: --neighbours does not apply to --method {}; leave it out", method));
      if (in.given("support") && !levelset::isVdbFormat(in.text("support")))
        throw UsageError(fmt::format("level-set: --support writes .vdb files only, not '{}'",
                                     in.text("support")));
    } else if (!in.operands.empty()) {
      refuseOptions(in,
                    {"neighbours", "fit-error", "lambda", "support", "kernel", "radius", "reach"},
                    "point clouds", "mesh");
    }
  };
  return withAdaptiveResult(std::move(op));
}

}  // namespace pipeline
