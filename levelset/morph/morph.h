#pragma once

#include <functional>
#include <optional>

#include "levelset/fields/mask.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

enum class MorphMethod {
  /// The surface at fraction s is the zero set of a weighted mean of both distances.
  Distances,
  /// The surface moves with the speed V = φ − φ_target along its normals.
  Speed
};

struct MorphOptions {
  MorphMethod method = MorphMethod::Distances;
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
///
/// With MorphMethod::Speed the surface follows φ_t + c(φ) (φ − φ_target) |∇φ| = 0, the level-set
/// morph of [Breen01]. It is there for comparison. HJ-WENO differences and TVD Runge-Kutta steps of
/// third order solve it; the cut-off c of [Brodersen07] fades the speed out towards the end of the
/// band, which is redistanced whenever the surface has moved a voxel. Fraction s is the time
/// −ln(1 − s): where the normals of surface and target agree, the distance to the target is then 1
/// − s of that at the start, as with the other method. Fraction 1 is the steady state.
/// @throws UsageError for fewer than one step, `until` outside (0, 1], a tolerance that is not
///         positive, `farthest` below 8, an invalid mask, or a mask with the speed method
/// @throws InvalidInput if a solid is empty, or if the surface vanishes at some fraction because
///         the solids do not overlap; with the speed method also if a connected part of the target
///         does not overlap the solid, or if a cavity of the target lies inside the solid
/// @throws NumericalError if the speed method ends more than a voxel from the target
/// @throws ResourceLimit when the distances do not fit into memory
/// @throws Cancelled
[[nodiscard]] NarrowBand morph(const NarrowBand& solid, const NarrowBand& target,
                               const MorphOptions& options = {});

/// The operator `morph`.
struct MorphOperator {
  static const OperatorText text;
  static constexpr std::size_t operandCount = 2;
  /// Error of the method `distances`. The pipeline refuses --method speed with --tolerance.
  static constexpr ErrorModel errorModel{2, 0.45, kCreaseError, "morph"};

  struct Options {
    MorphMethod method = MorphMethod::Distances;
    int steps = 1;
    std::string until = "converged";
    std::optional<double> tolerance;  ///< Hausdorff distance to the target, world units
    std::optional<Mask> mask;
    /// Receives the band of every step and its number, see MorphOptions::keep.
    std::function<void(const NarrowBand& step, int number)> keep;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("method", &Options::method,
            {{"distances", MorphMethod::Distances}, {"speed", MorphMethod::Speed}},
            {.help = "method: distances takes a weighted mean of both distances; speed moves the "
                     "surface by the difference of the two distances, to compare with"});
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
