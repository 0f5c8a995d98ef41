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
  double until = 1;  ///< last fraction of the morph, in (0, 1]; 1 ends on the target
  /// Hausdorff distance to the target, world units, at which the morph stops: the first step within
  /// this distance is the last step. Empty: all steps are computed.
  std::optional<double> tolerance = {};
  /// Scales the fraction of the morph at each point by the mask's weight there. The last step is
  /// then no longer the target.
  std::optional<Mask> mask = {};
  /// Distance from both surfaces, voxels, at least 8, up to which distances are computed; larger
  /// distances are clipped. A limit saves time when the solids are known to differ only near their
  /// surfaces. Empty: distances are computed wherever the surface passes.
  std::optional<double> farthest = {};
  /// Receives the band of every step and its number, 1 to `steps`, including the last step.
  std::function<void(const NarrowBand& step, int number)> keep = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Moves the surface of `solid` towards that of `target`, on the grid of `solid`. At fraction s the
/// surface is the zero set of (1 − s) · distance to the solid + s · distance to the target,
/// redistanced. Both distances are exact and known wherever the surface passes. A point inside only
/// one of the solids changes sides once, at a fraction of its own. So every step is nearer to the
/// target than the previous step, whatever the topology.
/// @throws UsageError for fewer than one step, `until` outside (0, 1], a tolerance that is not
///         positive, `farthest` below 8, or an invalid mask
/// @throws InvalidInput if a solid is empty, or if the surface vanishes at some fraction because
///         the solids do not overlap
/// @throws ResourceLimit when the distances do not fit into memory
/// @throws Cancelled
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
    std::optional<double> tolerance;  ///< Hausdorff distance to the target, world units
    std::optional<Mask> mask;
    /// Receives the band of every step and its number, see MorphOptions::keep.
    std::function<void(const NarrowBand& step, int number)> keep;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit(
          "steps", &Options::steps,
          {.help = "number of steps from the solid to the target", .range = OptionRange::Positive});
      visit("until", &Options::until,
            {.help = "fraction of the morph at which it ends, above 0 and up to 1; converged: 1, "
                     "the target"});
      visit("tolerance", &Options::tolerance,
            {.help = "stop at the first step within this Hausdorff distance of the target",
             .unit = OptionUnit::Length,
             .range = OptionRange::Positive});
      visit("mask", &Options::mask, {});
    }
  };

  static void check(const Options& options, const GivenOptions& given);
  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
};

}  // namespace levelset
