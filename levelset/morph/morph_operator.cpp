#include <fmt/core.h>

#include <charconv>

#include "levelset/error.h"
#include "levelset/inspect/compare.h"
#include "levelset/morph/morph.h"

namespace levelset {
namespace {

constexpr int kMostMorphSteps = 100000;

/// Converts the text of --until to the last fraction of the morph, in (0, 1].
double partOfTheWay(const std::string& until) {
  if (until == "converged") return 1;
  double part = 0;
  const char* begin = until.data() + (until.starts_with('+') ? 1 : 0);
  const char* end = until.data() + until.size();
  const auto [next, error] = std::from_chars(begin, end, part);
  if (error == std::errc() && next == end && part > 0 && part <= 1) return part;
  throw UsageError(
      fmt::format("--until: '{}' is no fraction of the morph; give converged, or a number above "
                  "0 and up to 1",
                  until));
}

}  // namespace

const OperatorText MorphOperator::text{
    .name = "morph",
    .group = "Flow",
    .summary = "turn the first solid into the second, step by step",
    .details =
        "Every step is nearer to the target than the previous step; topology may change. With "
        "--method speed every part of the target must overlap the solid. The result is on the grid "
        "of the first solid. --mask scales the fraction of the morph at each "
        "point, so the last step is not the target. Without names the operands are the two newest "
        "values, the target last.",
    .example =
        "levelsmith sphere --radius 1 --voxel 0.1 ! box --size 1.6,1.6,1.6 --voxel 0.1 ! "
        "morph --steps 3 ! measure"};

void MorphOperator::check(const Options& options, const GivenOptions& given) {
  if (partOfTheWay(options.until) < 1 && given("tolerance"))
    throw UsageError(
        "--tolerance stops the morph near the target, and --until stops it before; "
        "leave one of them out");
  if (given("mask") && given("tolerance"))
    throw UsageError(
        "--tolerance stops the morph near the target, which it does not reach with --mask; leave "
        "one of them out");
  if (given("mask") && options.method == MorphMethod::Speed)
    throw UsageError(
        "--mask scales the fraction of the morph, and the speed method has a time instead; leave "
        "one of them out");
  if (options.steps > kMostMorphSteps) {
    throw UsageError(fmt::format("--steps: {} steps are too many; give at most {}", options.steps,
                                 kMostMorphSteps));
  }
}

NarrowBand MorphOperator::run(std::vector<NarrowBand> operands, const Options& options,
                              OperatorRun& run) {
  NarrowBand result = morph(operands[0], operands[1],
                            {.method = options.method,
                             .steps = options.steps,
                             .until = partOfTheWay(options.until),
                             .tolerance = options.tolerance,
                             .mask = options.mask,
                             .keep = options.keep,
                             .maxMemory = run.maxMemory,
                             .progress = run.progress});
  if (options.tolerance || options.method == MorphMethod::Speed) {
    run.errors.push_back({"distance to the target, largest",
                          compare(result, operands[1]).hausdorff(), "world units"});
  }
  return result;
}

}  // namespace levelset
