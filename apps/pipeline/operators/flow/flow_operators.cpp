#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "apps/pipeline/grammar/file_sequence.h"
#include "apps/pipeline/graph/region_of_interest.h"
#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/fields.h"
#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/values/units.h"
#include "levelset/curvature/curvature_flow.h"
#include "levelset/curvature/smooth.h"
#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/flow/morph.h"
#include "levelset/inspect/compare.h"

namespace pipeline {
namespace {

using levelset::NarrowBand;
using levelset::UsageError;

// === curvature-flow

Value curvatureFlow(Invocation& in) {
  const std::string scheme = in.text("scheme");
  levelset::CurvatureFlowOptions options{.preservesVolume = in.flag("volume-preserving"),
                                         .maxMemory = in.maxMemory,
                                         .progress = in.progress};
  options.scheme = scheme == "explicit"     ? levelset::FlowScheme::Explicit
                   : scheme == "stabilized" ? levelset::FlowScheme::Stabilized
                   : scheme == "implicit"   ? levelset::FlowScheme::Implicit
                                            : levelset::FlowScheme::Auto;
  options.mask = maskOf(in);
  if (in.given("tolerance")) options.tolerance = in.length("tolerance");
  if (in.given("step")) options.step = in.number("step");
  NarrowBand band = in.band();
  in.operands.clear();
  levelset::CurvatureFlowResult result =
      levelset::curvatureFlow(std::move(band), in.number("time"), options);
  in.notes.notes.push_back(fmt::format("{} steps, {} evaluations, {} re-distancings", result.steps,
                                       result.evaluations, result.redistances));
  in.notes.errors.push_back(
      {"steps in time, rms over the surface", result.errorEstimate, "world units"});
  if (result.restedAfter)
    in.notes.notes.push_back(
        fmt::format("at rest after a time of {:.4g} world units squared", *result.restedAfter));
  if (options.tolerance && result.errorEstimate > *options.tolerance)
    in.notes.failure = fmt::format(
        "the steps in time leave about {:.3g} world units, more than the tolerance of {:.3g}, "
        "since for its sake none is made shorter than {:.3g}; ask for a shorter --step or a larger "
        "--tolerance",
        result.errorEstimate, *options.tolerance, result.shortestStep);
  return Value(std::move(result.band));
}

/// Stages of stabilized steps grow with the root of the time.
std::optional<Cost> costOfCurvatureFlow(Invocation& in) {
  const Plan solid = in.operands[0].plan();
  const double voxels = solid.activeVoxels();
  const double stages = std::sqrt(in.number("time")) / solid.voxelSize;
  return Cost{1e-9 * voxels * (3400 + 540 * stages), 300 * voxels};
}

// === smooth

levelset::SmoothKind smoothKind(const Invocation& in) {
  const std::string kind = in.text("kind");
  return kind == "mean"     ? levelset::SmoothKind::Mean
         : kind == "median" ? levelset::SmoothKind::Median
         : kind == "taubin" ? levelset::SmoothKind::Taubin
                            : levelset::SmoothKind::Gaussian;
}

Value smooth(Invocation& in) {
  const double sigma = in.length("sigma");
  NarrowBand band = in.band();
  in.operands.clear();
  return Value(
      levelset::smooth(std::move(band), smoothKind(in), sigma,
                       {.mask = maskOf(in), .maxMemory = in.maxMemory, .progress = in.progress}));
}

RegionOfInterest roiOfSmooth(Invocation& in, std::size_t, const RegionOfInterest& of) {
  if (in.given("mask")) return {};
  const Plan solid = in.operands[0].plan();
  const double voxel = solid.voxelSize;
  const double reach =
      levelset::smoothingReach(smoothKind(in), in.length("sigma") / voxel, solid.halfWidth);
  return {.region = grown(of.region, reach * voxel)};
}

/// The band is made as wide as the filter reads, filtered, and made distances of again.
std::optional<Cost> costOfSmooth(Invocation& in) {
  const Plan solid = in.operands[0].plan();
  const double layer = layerOf(solid), sigma = in.length("sigma") / solid.voxelSize;
  const levelset::SmoothKind kind = smoothKind(in);
  const double own = solid.halfWidth, read = levelset::smoothingWidth(kind, sigma);
  const double width = std::max(own, read);
  Cost cost;
  if (read > own) cost = costOfDistances(layer, width);
  const double taps = kind == levelset::SmoothKind::Median
                          ? 8 * 4.2 * std::pow(std::max(1.0, sigma), 3)
                          : 3 * (8 * sigma + 1) * (kind == levelset::SmoothKind::Taubin ? 2 : 1);
  cost += {0.5e-9 * taps * 2 * width * layer, layer * (300 + 25 * 2 * width)};
  return cost += costOfDistances(layer, own);
}

// === morph

FileSequence stepSequence(const Invocation& in) {
  const std::string pattern = in.text("keep-steps");
  FileSequence sequence(pattern);
  if (!sequence.hasNumber() || !levelset::isBandFormat(pattern))
    throw UsageError(
        fmt::format("{}: '{}' is not a sequence of .vdb files; write # for the number, as in "
                    "step_###.vdb",
                    in.where("keep-steps"), pattern));
  return sequence;
}

double partOfTheWay(const Invocation& in) {
  const std::string text = in.text("until");
  if (text == "converged") return 1;
  try {
    if (const double part = parseNumber(text, "until"); part > 0 && part <= 1) return part;
  } catch (const UsageError&) {  // told below
  }
  throw UsageError(
      fmt::format("{}: '{}' is no part of the way; write converged, or a number above "
                  "0 and up to 1",
                  in.where("until"), text));
}

/// Every file that --keep-steps may write.
std::vector<std::string> stepFiles(const Invocation& in) {
  std::vector<std::string> files;
  if (!in.given("keep-steps")) return files;
  const FileSequence sequence = stepSequence(in);
  const auto steps = static_cast<std::size_t>(in.integer("steps"));
  for (std::size_t i = 1; i <= steps; ++i) files.push_back(sequence.file(i).string());
  return files;
}

constexpr long kMostSteps = 100000;

void validateMorph(const Invocation& in) {
  if (in.given("keep-steps")) (void)stepSequence(in);
  if (partOfTheWay(in) < 1 && in.given("tolerance"))
    throw UsageError(
        "morph: --tolerance tells when the target is reached, and --until ends before; "
        "leave one of them out");
  if (in.given("mask") && in.given("tolerance"))
    throw UsageError(
        "morph: --tolerance tells when the target is reached, and with --mask it is not; leave one "
        "of them out");
  if (in.integer("steps") > kMostSteps) {
    throw UsageError(fmt::format("{}: {} are too many; give at most {}", in.where("steps"),
                                 in.text("steps"), kMostSteps));
  }
}

Value morph(Invocation& in) {
  levelset::MorphOptions options{.steps = static_cast<int>(in.integer("steps")),
                                 .until = partOfTheWay(in),
                                 .maxMemory = in.maxMemory,
                                 .progress = in.progress};
  options.mask = maskOf(in);
  if (in.given("tolerance")) options.tolerance = in.length("tolerance");
  if (in.given("keep-steps")) {
    options.keep = [sequence = stepSequence(in)](const NarrowBand& step, int number) {
      levelset::writeBand(sequence.file(static_cast<std::size_t>(number)), step);
    };
  }
  NarrowBand result = levelset::morph(in.band(0), in.band(1), options);
  if (options.tolerance) {
    in.notes.errors.push_back({"distance to the target, largest",
                               levelset::compare(result, in.band(1)).hausdorff(), "world units"});
  }
  return Value(std::move(result));
}

}  // namespace

void addFlowOperators(std::vector<Operator>& all) {
  all.push_back(
      {.name = "curvature-flow",
       .group = "Flow",
       .summary = "move the surface inwards with its curvature k1 + k2",
       .details =
           "A ball obeys R² = R0² - 4 time. Topology may change; a solid that vanishes on the "
           "way is refused, with the time. Steps are as long as the tolerance allows and "
           "stable whatever is asked. Where the tolerance is not reached the result is still "
           "written, and the exit code is 5. A flow that keeps its volume ends at rest.",
       .example = "levelsmith box --size 2,2,2 --voxel 0.1 ! curvature-flow --time 0.05 ! measure",
       .params = withMask({{.name = "time",
                            .doc = "how long, world units squared",
                            .range = Range::NonNegative,
                            .required = true,
                            .position = 0},
                           {.name = "volume-preserving",
                            .type = ParamType::Flag,
                            .doc = "take the mean curvature off, so that the volume stays"},
                           {.name = "scheme",
                            .type = ParamType::Choice,
                            .doc = "of the steps in time; auto: what is predicted to cost least",
                            .fallback = "auto",
                            .choices = {"auto", "explicit", "stabilized", "implicit"}},
                           {.name = "tolerance",
                            .type = ParamType::Length,
                            .doc = "error of the steps in time, rms; default: 0.02vx",
                            .range = Range::Positive},
                           {.name = "step",
                            .doc = "longest step, world units squared",
                            .range = Range::Positive}}),
       .operands = {{Kind::Band}},
       .run = curvatureFlow,
       .cost = costOfCurvatureFlow});
  all.push_back(
      {.name = "smooth",
       .group = "Flow",
       .summary = "smooth the surface by a filter of its distances",
       .details =
           "gaussian: a Gaussian of that sigma; mean: a box of the same variance; median: over "
           "the grid points within sigma, which takes long when it is large; taubin: a Gaussian "
           "that gives long waves back what "
           "they lost.",
       .example = "levelsmith box --size 2,2,2 --voxel 0.1 ! smooth --sigma 1vx ! measure",
       .params = withMask({{.name = "kind",
                            .type = ParamType::Choice,
                            .doc = "of the filter",
                            .fallback = "gaussian",
                            .choices = {"gaussian", "mean", "median", "taubin"}},
                           {.name = "sigma",
                            .type = ParamType::Length,
                            .doc = "standard deviation of the filter",
                            .range = Range::Positive,
                            .required = true}}),
       .operands = {{Kind::Band}},
       .run = smooth,
       .cost = costOfSmooth,
       .slope = Slope::One,
       .regionOfInterest = roiOfSmooth,
       .partTolerance = kDistanceTolerance});
  all.push_back(
      {.name = "morph",
       .group = "Flow",
       .summary = "turn the first solid into the second, step by step",
       .details =
           "Every step is nearer to the target than the one before; topology may change. The "
           "result stays on the grid of the first. With --mask a part of the way is gone at each "
           "point, and the end is no longer the target. Without names it takes the two newest "
           "values, the target last.",
       .example = "levelsmith sphere --radius 1 --voxel 0.1 ! box --size 1.6,1.6,1.6 --voxel 0.1 ! "
                  "morph --steps 3 ! measure",
       .params =
           withMask({{.name = "steps",
                      .type = ParamType::Integer,
                      .doc = "in which the way is gone",
                      .fallback = "1",
                      .range = Range::Positive},
                     {.name = "until",
                      .type = ParamType::Text,
                      .doc = "converged: on the target; or a part of the way, above 0 and up to 1",
                      .fallback = "converged"},
                     {.name = "tolerance",
                      .type = ParamType::Length,
                      .doc = "a step as near as this to the target is the last",
                      .range = Range::Positive},
                     {.name = "keep-steps",
                      .type = ParamType::Path,
                      .doc = "write every step; # in the name is its number (step_###.vdb)"}}),
       .operands = {{Kind::Band}, {Kind::Band}},
       .run = morph,
       .validate = validateMorph,
       .targets = stepFiles});
}

}  // namespace pipeline
