#pragma once

// Internal header of levelset: public headers must not include it.

#include <functional>
#include <memory>

#include "levelset/curvature_flow/curvature_flow.h"
#include "levelset/curvature_flow/curvature_state_vdb.h"
#include "levelset/curvature_flow/helmholtz_vdb.h"

namespace levelset::flow {

/// Returns the number of stages of a Runge-Kutta-Legendre step of length `dt`, voxels². It is
/// always odd.
[[nodiscard]] int legendreStages(double dt);

/// Returns the predicted cost of a step of length `dt`, voxels², in units of one evaluation of φ_t
/// over the band. It is derived from the number of values read, not measured.
[[nodiscard]] double predictedCost(FlowScheme scheme, double dt);

/// Time stepping of a curvature flow; lengths in voxels, times in voxels². Keeps its fields between
/// steps.
class CurvatureSteps {
 public:
  /// @param pulse  called repeatedly during a step; may throw to stop it
  CurvatureSteps(CurvatureState& state, std::function<void()> pulse);

  /// Takes one step. rate() must be the rate of the state's current value; the step updates both.
  /// @return estimated error of the step, rms over the surface, voxels
  double take(FlowScheme scheme, double dt);
  /// Restores the value and the rate that the state had before the last step.
  void undo();
  /// Adds `by` voxels times the mask weight to φ at each grid point. Does not update rate().
  void raise(double by);
  /// Recomputes rate(), after raise() or a change of the shift.
  void refreshRate();

  [[nodiscard]] const Field& rate() const { return rate_; }
  double shift = 0;  ///< constant subtracted from the curvature, voxels⁻¹
  [[nodiscard]] std::size_t evaluations() const { return static_cast<std::size_t>(work_); }
  /// Returns the power of the step length with which the error of one step grows.
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
  std::unique_ptr<HelmholtzSolver> solver_;  ///< created at the first implicit step
  double work_ = 0;
};

}  // namespace levelset::flow
