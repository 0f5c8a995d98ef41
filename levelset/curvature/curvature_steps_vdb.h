#pragma once

// Internal header of levelset: public headers must not include it.

#include <functional>
#include <memory>

#include "levelset/curvature/curvature_flow.h"
#include "levelset/curvature/curvature_state_vdb.h"
#include "levelset/curvature/helmholtz_vdb.h"

namespace levelset::flow {

/// Stages that a Runge-Kutta-Legendre step of this length takes, odd.
[[nodiscard]] int legendreStages(double dt);

/// What a step costs, in evaluations of the rate. Counts of operations, not measured times.
[[nodiscard]] double predictedCost(FlowScheme scheme, double dt);

/// Steps in time; lengths in voxels, times in voxels². Keeps its fields between steps.
class CurvatureSteps {
 public:
  /// @param pulse  called now and then during a step; throws to stop
  CurvatureSteps(CurvatureState& state, std::function<void()> pulse);

  /// Takes one step. `rate` must be that of the state; it is brought up to date.
  /// @return rms over the surface of the estimated error of the step
  double take(FlowScheme scheme, double dt);
  /// Takes the last step back.
  void undo();
  /// Adds `by` times the weights to all values.
  void raise(double by);
  /// After raise() or a change of the shift.
  void refreshRate();

  [[nodiscard]] const Field& rate() const { return rate_; }
  double shift = 0;  ///< taken from the curvature
  [[nodiscard]] std::size_t evaluations() const { return static_cast<std::size_t>(work_); }
  /// The error grows with this power of the step.
  [[nodiscard]] static int errorOrder(FlowScheme scheme) {
    return scheme == FlowScheme::Stabilized ? 3 : 2;
  }

 private:
  void evaluate(const Field& field, Field& rate);
  void eulerStep(double dt);
  void legendreStep(double dt);
  double implicitStep(double dt);
  template <typename Error>
  [[nodiscard]] double rmsNearSurface(const Error& error) const;

  CurvatureState& state_;
  std::function<void()> pulse_;
  Field before_, rate_, rateBefore_, last_, older_, stageRate_;
  std::unique_ptr<HelmholtzSolver> solver_;  ///< made when first used
  double work_ = 0;
};

}  // namespace levelset::flow
