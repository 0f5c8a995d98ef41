#pragma once

#include <optional>

#include "levelset/fields/mask.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

/// Schemes of the time steps.
enum class FlowScheme {
  Auto,      ///< scheme with the least predicted cost
  Explicit,  ///< Euler steps
  /// Runge-Kutta-Legendre of second order: s stages replace about s²/4 Euler steps.
  Stabilized,
  /// Linearly implicit, second order by extrapolation, solved with conjugate gradients.
  Implicit
};

struct CurvatureFlowOptions {
  FlowScheme scheme = FlowScheme::Auto;
  bool preservesVolume = false;   ///< normal velocity V_n = mean of κ over the surface − κ
  std::optional<Mask> mask = {};  ///< weight that multiplies V_n
  /// Largest error of the time steps, rms over the surface, world units. Empty: 0.02 voxels.
  std::optional<double> tolerance = {};
  /// Longest step, world units²; shortened where the surface would leave the band. Empty: no limit.
  std::optional<double> step = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct CurvatureFlowResult {
  NarrowBand band;
  /// Scheme used for most of the time; Auto: no step was taken.
  FlowScheme scheme = FlowScheme::Auto;
  std::size_t steps = 0;
  /// Evaluations of φ_t over the band; the work of implicit solves is counted in units of one
  /// evaluation.
  std::size_t evaluations = 0;
  std::size_t redistances = 0;  ///< number of distance transforms
  /// Estimated error of the time steps, rms over the surface, world units.
  double errorEstimate = 0;
  double shortestStep = 0;  ///< the tolerance shortens no step below this length, world units²
  double longestStep = 0;   ///< longest step taken, world units²
  /// Time after which the surface was at rest, world units². Set only with preservesVolume.
  std::optional<double> restedAfter = {};
};

/// Moves the surface inwards with the speed κ = k1 + k2 for a `time` in world units²: a ball obeys
/// R² = R0² − 4 time. The topology may change, and parts may vanish. The differences for κ|∇φ| are
/// of fourth order where the surface is smooth at the scale of the voxels. The band is redistanced
/// when the surface has moved by about 1.5 voxels, not in each step. The default tolerance of the
/// time steps is 0.02 voxels. [Meyer14, Smereka03, Sommeijer98] With preservesVolume the flow ends
/// when the surface is at rest.
/// @throws UsageError for a time, step or tolerance that is not positive and finite (time may be 0)
/// @throws InvalidInput if `solid` is empty, or vanishes during the flow; the message gives the
///         time
/// @throws ResourceLimit when the band does not fit into memory, and for more than 100 000 steps
/// @throws Cancelled
[[nodiscard]] CurvatureFlowResult curvatureFlow(NarrowBand solid, double time,
                                                const CurvatureFlowOptions& options = {});

/// The operator `curvature-flow`.
struct CurvatureFlowOperator {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, 0.9, 0, "curvature-sphere"};

  struct Options {
    double time = 0;  ///< duration of the flow, world units²
    bool preservesVolume = false;
    FlowScheme scheme = FlowScheme::Auto;
    /// Largest error of the time steps, rms over the surface, world units. Empty: 0.02 voxels.
    std::optional<double> tolerance;
    std::optional<double> step;  ///< longest step, world units²; empty: no limit
    std::optional<Mask> mask;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("time", &Options::time,
            {.help = "duration of the flow, world units squared",
             .range = OptionRange::NonNegative,
             .required = true,
             .position = 0});
      visit("volume-preserving", &Options::preservesVolume,
            {.help = "subtract the mean of the speed over the surface from the speed, so that the "
                     "volume stays constant"});
      visit(
          "scheme", &Options::scheme,
          {{"auto", FlowScheme::Auto},
           {"explicit", FlowScheme::Explicit},
           {"stabilized", FlowScheme::Stabilized},
           {"implicit", FlowScheme::Implicit}},
          {.help =
               "scheme of the time steps; auto chooses the scheme with the least predicted cost"});
      visit("tolerance", &Options::tolerance,
            {.help = "largest accepted displacement of the surface by the error of the time steps, "
                     "rms over the surface; default: 0.02vx",
             .unit = OptionUnit::Length,
             .range = OptionRange::Positive});
      visit("step", &Options::step,
            {.help = "longest time step, world units squared; default: no limit",
             .range = OptionRange::Positive});
      visit("mask", &Options::mask, {});
    }
  };

  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

}  // namespace levelset
