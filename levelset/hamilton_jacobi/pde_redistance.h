#pragma once

#include <optional>

#include "levelset/distance/redistance.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

struct PdeRedistanceOptions {
  /// Half width of the result, voxels; empty: that of the operand.
  std::optional<double> halfWidth = {};
  /// Order of the upwind differences: 1, 2 or 3 (HJ-ENO) or 5 (HJ-WENO).
  int order = 5;
  /// Order of the steps in time: 1 (Euler), 2 or 3 (TVD Runge-Kutta).
  int timeOrder = 3;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Recomputes the signed distance by solving φ_τ + S (|∇φ| − 1) = 0 with S = φ0 / √(φ0² + |∇φ0|²
/// h²) [Peng99], until the fronts have crossed the band. h is the voxel size. Godunov's gradient
/// takes upwind differences [Osher91, Jiang00], and the steps are TVD Runge-Kutta steps [Shu88]. It
/// exists for comparison with redistance(), which is more accurate and moves no surface: the
/// differences read across the surface, so the surface moves.
/// @param field  correct sign everywhere, Lipschitz continuous; values in the band have slopes of
///               about 1, not below 0.1
/// @return band of the requested half width
/// @throws InvalidInput if the field has no zero crossing
/// @throws UsageError for a half width below 1, or for orders that do not exist
/// @throws ResourceLimit when the fields of the solver do not fit into memory
/// @throws Cancelled
[[nodiscard]] NarrowBand pdeRedistance(const NarrowBand& field,
                                       const PdeRedistanceOptions& options = {});

enum class RedistanceMethod {
  Exact,  ///< redistance()
  Pde     ///< pdeRedistance()
};

/// The operator `reinitialize`.
struct ReinitializeOperator {
  static const OperatorText text;
  static constexpr Slope slope = Slope::One;
  static constexpr double partTolerance = kDistanceTolerance;
  /// Error of the exact method. The pipeline refuses --method pde with --tolerance.
  static constexpr ErrorModel errorModel{2, kTriangleError, 0, "redistance"};

  struct Options {
    std::optional<double> halfWidth;
    RedistanceMethod method = RedistanceMethod::Exact;
    int order = 5, timeOrder = 3;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("half-width", &Options::halfWidth, kResultHalfWidth);
      visit(
          "method", &Options::method,
          {{"exact", RedistanceMethod::Exact}, {"pde", RedistanceMethod::Pde}},
          {.help = "method: exact finds closest points; pde solves the reinitialization equation, "
                   "to compare with"});
      visit("order", &Options::order,
            {.help = "with --method pde: order in space; 1 upwind differences, 2 or 3 HJ-ENO, 5 "
                     "HJ-WENO",
             .range = OptionRange::Positive});
      visit("time-order", &Options::timeOrder,
            {.help = "with --method pde: order in time; 1 Euler, 2 or 3 TVD Runge-Kutta",
             .range = OptionRange::Positive});
    }
  };

  static void check(const Options& options, const GivenOptions& given);
  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
  static RegionOfInterest regionOfInterest(const Options& options, const OperatorPlans& plans,
                                           std::size_t operand, const RegionOfInterest& ofResult);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

}  // namespace levelset
