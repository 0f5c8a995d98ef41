#pragma once

#include <functional>
#include <optional>

#include "levelset/fields/mask.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

struct MorphOptions {
  int steps = 1;
  double until = 1;  ///< part of the path, in (0, 1]; 1 ends on the target
  /// World units: the first step whose surface is no farther than this from that of the target, and
  /// the reverse (Hausdorff distance), is the last. Empty: all steps are gone.
  std::optional<double> tolerance = {};
  /// Of the path, this part is gone at each point; the end is then no longer the target.
  std::optional<Mask> mask = {};
  /// Distances count no further than this, voxels: for a mask that parts solids which differ near
  /// their surfaces only, where it saves sweeping them whole. Empty: wherever the surface passes.
  std::optional<double> farthest = {};
  /// Receives every step, 1 to `steps`, the last one too.
  std::function<void(const NarrowBand& step, int number)> keep = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
  const char* action = "morph";  ///< in messages
};

/// Moves the surface of `solid` on to that of `target`, on the grid of `solid`. At the part s of
/// the path it is the zero set of (1 − s) distance to the solid + s distance to the target, both
/// exact and known wherever the surface passes, re-distanced. A point that belongs to one of the
/// solids only changes sides once, at a time of its own: every step is nearer to the target than
/// the one before, whatever the topology.
/// @throws UsageError for fewer than one step, `until` outside (0, 1], a tolerance that is not
/// positive or a bad mask; InvalidInput if a solid is
/// empty, or if nothing is left on the path (the solids lie apart); ResourceLimit; Cancelled
[[nodiscard]] NarrowBand morph(const NarrowBand& solid, const NarrowBand& target,
                               const MorphOptions& options = {});

/// The operator `morph`.
struct MorphOperator {
  static const OperatorText text;
  static constexpr std::size_t operandCount = 2;
  static constexpr ErrorModel errorModel{2, 0.45, kCreaseError, "morph"};

  struct Options {
    int steps = 1;
    std::string until = "converged";
    std::optional<double> tolerance;  ///< world units
    std::optional<Mask> mask;
    std::function<void(const NarrowBand& step, int number)> keep;  ///< as MorphOptions::keep

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit(
          "steps", &Options::steps,
          {.help = "number of steps from the solid to the target", .range = OptionRange::Positive});
      visit("until", &Options::until,
            {.help = "converged: on the target; or a part of the way, above 0 and up to 1"});
      visit("tolerance", &Options::tolerance,
            {.help = "a step as near as this to the target is the last",
             .unit = OptionUnit::Length,
             .range = OptionRange::Positive});
      visit("mask", &Options::mask, {});
    }
  };

  static void check(const Options& options, const GivenOptions& given);
  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
};

}  // namespace levelset
