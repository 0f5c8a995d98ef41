#pragma once

#include <optional>

#include "levelset/fields/mask.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

enum class FlowScheme {
  Auto,        ///< whichever of the others is predicted to cost least
  Explicit,    ///< Euler steps
  Stabilized,  ///< Runge-Kutta-Legendre of second order, s stages for about s²/4 Euler steps
  Implicit     ///< linearly implicit, second order by extrapolation, conjugate gradients
};

struct CurvatureFlowOptions {
  FlowScheme scheme = FlowScheme::Auto;
  bool preservesVolume = false;   ///< V_n = mean of κ over the surface − κ
  std::optional<Mask> mask = {};  ///< V_n times its weight
  std::optional<double> tolerance =
      {};                           ///< of the steps in time, rms over the surface, world units
  std::optional<double> step = {};  ///< longest step, world units²; cut where the band is left
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct CurvatureFlowResult {
  NarrowBand band;
  FlowScheme scheme = FlowScheme::Auto;  ///< that took most of the time; Auto: there was no step
  std::size_t steps = 0;
  std::size_t evaluations = 0;  ///< of the rate over the band, or what costs as much
  std::size_t redistances = 0;
  double errorEstimate = 0;  ///< of the steps in time, rms over the surface, world units
  double shortestStep = 0;   ///< world units²; no step is made shorter for the tolerance's sake
  double longestStep = 0;    ///< of those that were taken, world units²
  std::optional<double> restedAfter = {};  ///< a time; with preservesVolume nothing moved any more
};

/// Moves the surface inwards with the speed κ = k1 + k2 for a `time` in world units²: a ball obeys
/// R² = R0² − 4 time. Topology may change; parts may vanish.
/// κ|∇φ| is of fourth order where the surface is smooth at the scale of the voxels. Distances are
/// made again only when the surface has moved a voxel and a half. Without a tolerance the steps in
/// time leave two hundredths of a voxel. [Meyer14, Smereka03, Sommeijer98]
/// With preservesVolume it ends when the surface has come to rest.
/// @throws UsageError for a time, step or tolerance that is not positive and finite (time may be
/// 0); InvalidInput if `solid` is empty or vanishes on the way, telling when; ResourceLimit,
/// also for more than 100 000 steps; Cancelled
[[nodiscard]] CurvatureFlowResult curvatureFlow(NarrowBand solid, double time,
                                                const CurvatureFlowOptions& options = {});

/// The operator `curvature-flow`.
struct CurvatureFlowOperator {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, 0.9, 0, "curvature-sphere"};

  struct Options {
    double time = 0;  ///< world units²
    bool preservesVolume = false;
    FlowScheme scheme = FlowScheme::Auto;
    std::optional<double> tolerance;  ///< world units
    std::optional<double> step;       ///< world units²
    std::optional<Mask> mask;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("time", &Options::time,
            {.help = "length of time, world units squared",
             .range = OptionRange::NonNegative,
             .required = true,
             .position = 0});
      visit("volume-preserving", &Options::preservesVolume,
            {.help = "take the mean curvature off, so that the volume stays"});
      visit("scheme", &Options::scheme,
            {{"auto", FlowScheme::Auto},
             {"explicit", FlowScheme::Explicit},
             {"stabilized", FlowScheme::Stabilized},
             {"implicit", FlowScheme::Implicit}},
            {.help = "scheme of the steps in time; auto: the one predicted to cost least"});
      visit("tolerance", &Options::tolerance,
            {.help = "error of the steps in time, rms; default: 0.02vx",
             .unit = OptionUnit::Length,
             .range = OptionRange::Positive});
      visit("step", &Options::step,
            {.help = "longest step, world units squared", .range = OptionRange::Positive});
      visit("mask", &Options::mask, {});
    }
  };

  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

}  // namespace levelset
