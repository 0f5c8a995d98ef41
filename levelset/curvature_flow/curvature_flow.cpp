#include "levelset/curvature_flow/curvature_flow.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/curvature_flow/curvature_rate_vdb.h"
#include "levelset/curvature_flow/curvature_steps_vdb.h"
#include "levelset/distance/distance_transform.h"
#include "levelset/distance/surface/surface_points.h"
#include "levelset/error.h"

namespace levelset {
namespace {

using flow::CurvatureState;
using flow::CurvatureSteps;
using flow::NearSurface;

// Default limit of the error of all time steps together, rms over the surface, voxels.
constexpr double kDefaultTolerance = 0.02;
// Largest and smallest ratio of successive steps, and safety factor on the step length that the
// error estimate allows.
constexpr double kMostGrowth = 3, kMostShrinkage = 0.2, kSafety = 0.8;
// Longest first step after each redistancing, which has no error control, voxels².
constexpr double kFirstStep = 10 * flow::kExplicitStep;
// The band is redistanced when it limits the next step to less than this fraction of both the
// wanted step and the time in which the surface moves by kFlowTravel.
constexpr double kLeastShare = 0.4;
// Number of fields (a float for each grid point of the blocks) in memory during a step.
constexpr double kFields = 9;
constexpr double kVolumeTolerance = 1e-6;  // relative error of the preserved volume
constexpr std::size_t kMostFlowSteps = 100000;
// A surface with preserved volume is at rest when its rate would move it less than this distance,
// in voxels, over the time 1 / κ² in which it becomes round (κ: mean curvature).
constexpr double kRestMove = 0.05;

void checkPositive(double value, const char* what, const char* unit) {
  if (!(value > 0) || !std::isfinite(value))
    throw UsageError(fmt::format("the {} is {}; give a positive number of {}", what, value, unit));
}

void checkArguments(const NarrowBand& solid, double time, const CurvatureFlowOptions& options) {
  if (!(time >= 0) || !std::isfinite(time))
    throw UsageError(fmt::format(
        "the time is {}; give a finite time of 0 or more, in world units squared", time));
  if (options.tolerance) checkPositive(*options.tolerance, "tolerance", "world units");
  if (options.step) checkPositive(*options.step, "step", "world units squared");
  if (options.mask) checkMask(*options.mask);
  requireSolid(solid);
  if (solid.isEmpty())
    throw InvalidInput(
        "the solid is empty, so there is no surface to move; give a solid with a surface");
  if (options.step && time / *options.step > static_cast<double>(kMostFlowSteps))
    throw ResourceLimit(fmt::format(
        "a time of {} in steps of {} requires {:.3g} steps, more than the limit of {}; use "
        "longer steps or a shorter time",
        time, *options.step, time / *options.step, kMostFlowSteps));
}

/// Time in voxels² after which the corners of a cube have moved by a voxel. Later the surface has
/// no edges that the distance transform must search for.
constexpr double kEdgesGone = 0.5;

/// Curvature flow of one solid. Lengths are in voxels, times in voxels².
class CurvatureFlow {
 public:
  CurvatureFlow(const NarrowBand& solid, double time, const CurvatureFlowOptions& options)
      : options_(options),
        voxel_(solid.voxelSize()),
        time_(time / voxel_ / voxel_),
        tolerance_(options.tolerance ? *options.tolerance / voxel_ : kDefaultTolerance),
        longest_(options.step ? *options.step / voxel_ / voxel_ : time_) {}

  CurvatureFlowResult run(const NarrowBand& solid) {
    openvdb::FloatGrid::Ptr grid = distances(vdb(solid), flow::kFlowWidth);
    while (now_ < time_) {
      checkMemory(*grid);
      grid = runOn(*grid);
      requireSurface(*grid);
      if (now_ < time_) grid = distances(*grid, flow::kFlowWidth);
    }
    result_.band = makeBand(distances(*grid, solid.halfWidth()));
    result_.errorEstimate = error_ * voxel_;
    result_.shortestStep = flow::kExplicitStep * voxel_ * voxel_;
    result_.longestStep = longestTaken_ * voxel_ * voxel_;
    result_.scheme = *std::max_element(kSchemes.begin(), kSchemes.end(), [&](auto a, auto b) {
      return spent_[index(a)] < spent_[index(b)];
    });
    if (result_.steps == 0) result_.scheme = FlowScheme::Auto;
    report(options_.progress, 1);
    return std::move(result_);
  }

 private:
  static constexpr std::array<FlowScheme, 3> kSchemes = {
      FlowScheme::Explicit, FlowScheme::Stabilized, FlowScheme::Implicit};
  static std::size_t index(FlowScheme scheme) { return static_cast<std::size_t>(scheme); }

  void reportProgress() const { report(options_.progress, 0.99 * now_ / time_); }

  openvdb::FloatGrid::Ptr distances(const openvdb::FloatGrid& field, double halfWidth) {
    eikonal::DistanceRequest request;
    request.halfWidth = halfWidth;
    request.mayHaveEdges = now_ < kEdgesGone || options_.mask;
    request.maxMemory = options_.maxMemory;
    const double done = time_ > 0 ? 0.99 * now_ / time_ : 0;
    request.progress = subProgress(options_.progress, done, done);
    ++result_.redistances;
    return eikonal::distanceTransform(field, request);
  }

  void checkMemory(const openvdb::FloatGrid& grid) const {
    const double blocks = static_cast<double>(grid.tree().leafCount());
    requireMemory(blocks * sizeof(flow::Values) * kFields, options_.maxMemory);
  }

  void requireSurface(const openvdb::FloatGrid& grid) const {
    if (eikonal::hasZeroCrossing(grid.tree())) return;
    throw InvalidInput(
        fmt::format("the solid vanishes after a time of {:.4g} world units squared, before the "
                    "requested {:.4g}; give a shorter time",
                    now_ * voxel_ * voxel_, time_ * voxel_ * voxel_));
  }

  /// Integrates until the band must be redistanced, the surface has vanished or is at rest, or the
  /// time is over.
  /// @return the field after the last step, not redistanced
  openvdb::FloatGrid::Ptr runOn(const openvdb::FloatGrid& grid) {
    CurvatureState state(grid, options_.mask);
    CurvatureSteps steps(state, [&] { reportProgress(); });
    if (options_.preservesVolume) prepareVolume(grid, state, steps);
    const double begun = now_;
    for (bool first = true; now_ < time_; first = false) {
      const NearSurface near = flow::measureNearSurface(state, steps.rate());
      if (near.count == 0) break;
      if (options_.preservesVolume && isAtRest(state, near, steps.shift, now_ - begun)) {
        result_.restedAfter = now_ * voxel_ * voxel_;
        now_ = time_;
        break;
      }
      const double left = time_ - now_;
      const double wanted = std::min({wanted_, longest_, left});
      const double onSurface =
          near.fastest > 0 ? std::max(0.0, flow::kFlowTravel - near.displaced) / near.fastest
                           : left;
      const double whole = onSurface + (near.fastest > 0 ? near.displaced / near.fastest : 0);
      const double available = std::min(onSurface, near.clear);
      if (!first && available < kLeastShare * std::min(wanted, whole)) break;
      // A step of kExplicitStep is stable with any scheme, so the flow always advances.
      double dt = std::min(wanted, std::max(available, flow::kExplicitStep));
      if (dt > 0.999 * left) dt = left;
      step(state, steps, first ? std::min(dt, kFirstStep) : dt, first);
    }
    result_.evaluations += steps.evaluations();
    return state.toGrid(grid);
  }

  /// Returns true when the current rate moves the surface less than kRestMove allows: it is at
  /// rest. Long steps and redistancing leave a roughness whose rate may exceed that limit. So the
  /// mean rate, the displacement of the surface since redistancing divided by the time `elapsed`,
  /// is tested too.
  static bool isAtRest(const CurvatureState& state, const NearSurface& near, double meanCurvature,
                       double elapsed) {
    const double rounding = meanCurvature * meanCurvature;
    if (near.unevenness() < kRestMove * rounding) return true;
    if (elapsed * rounding < 1) return false;
    flow::Field moved = state.value;
    for (std::size_t i = 0; i < moved.size(); ++i)
      for (std::size_t n = 0; n < 512; ++n) moved[i][n] -= state.start()[i][n];
    return flow::measureNearSurface(state, moved).unevenness() < kRestMove * rounding * elapsed;
  }

  /// Returns the time over which the errors of the steps may add up to the tolerance. With
  /// preserved volume, earlier errors decay while the surface becomes round: the slowest wave on a
  /// ball decays at a rate equal to the square of the mean curvature.
  double errorSpan(double meanCurvature) const {
    if (!options_.preservesVolume || meanCurvature == 0) return time_;
    return std::min(time_, 1 / (meanCurvature * meanCurvature));
  }

  void requireEnd(double dt) const {
    if (result_.steps < kMostFlowSteps && now_ + dt > now_) return;
    throw ResourceLimit(fmt::format(
        "{} steps reached a time of {:.4g} world units squared, and the next "
        "step is {:.3g}, so the requested {:.4g} takes too many steps; use a shorter time "
        "or larger voxels",
        result_.steps, now_ * voxel_ * voxel_, dt * voxel_ * voxel_, time_ * voxel_ * voxel_));
  }

  FlowScheme cheapest(double dt, double left) const {
    if (options_.scheme != FlowScheme::Auto) return options_.scheme;
    // Predicted cost of the remaining time `left` with steps of length dt; explicit steps choose
    // their own length.
    const auto cost = [&](FlowScheme scheme) {
      return scheme == FlowScheme::Explicit ? flow::predictedCost(scheme, left)
                                            : left / dt * flow::predictedCost(scheme, dt);
    };
    return *std::min_element(kSchemes.begin(), kSchemes.end(),
                             [&](auto a, auto b) { return cost(a) < cost(b); });
  }

  /// Takes one step of at most dt. The first step after redistancing has no error control: it
  /// smooths the rounding errors of the distances, and an error estimate would measure only those.
  void step(CurvatureState& state, CurvatureSteps& steps, double dt, bool first) {
    const FlowScheme scheme = cheapest(dt, time_ - now_);
    if (scheme == FlowScheme::Explicit) dt = std::min(dt, flow::kExplicitStep);
    requireEnd(dt);
    const double span = errorSpan(steps.shift);
    const double power = 1.0 / CurvatureSteps::errorOrder(scheme);
    for (;;) {
      const double error = steps.take(scheme, dt);
      if (first) break;
      const double allowed = tolerance_ * dt / span;
      const double factor = error > 0 ? std::clamp(kSafety * std::pow(allowed / error, power),
                                                   kMostShrinkage, kMostGrowth)
                                      : kMostGrowth;
      const bool isShortest = dt <= 1.001 * flow::kExplicitStep;
      if (error > allowed && !isShortest) {
        steps.undo();
        dt = std::max(flow::kExplicitStep, dt * std::min(factor, 0.7));
        wanted_ = dt;
        continue;
      }
      // If the band has shortened dt, dt * factor does not limit the next step, so a longer wanted
      // step is kept.
      wanted_ = std::max({flow::kExplicitStep, dt * factor, factor > 1 ? wanted_ : 0.0});
      if (span < time_) error_ *= std::exp(-dt / span);
      error_ += error;
      break;
    }
    now_ = dt >= time_ - now_ ? time_ : now_ + dt;
    spent_[index(scheme)] += dt;
    longestTaken_ = std::max(longestTaken_, dt);
    ++result_.steps;
    if (options_.preservesVolume) keepVolume(state, steps);
    reportProgress();
  }

  // === Volume

  void prepareVolume(const openvdb::FloatGrid& grid, CurvatureState& state, CurvatureSteps& steps) {
    inactive_ = flow::inactiveVolume(grid.tree());
    if (!volume_)
      volume_ = inactive_ + flow::volumeAndAreaOf(state, steps.rate(), steps.shift).volume;
    keepVolume(state, steps);
  }

  /// Offsets the surface until it has the volume of the given solid again. Then updates the mean
  /// curvature, which is subtracted from the curvature in the next steps.
  void keepVolume(CurvatureState& state, CurvatureSteps& steps) {
    constexpr int kMostCorrections = 4;
    for (int i = 0; i < kMostCorrections; ++i) {
      const flow::VolumeAndArea volumeAndArea =
          flow::volumeAndAreaOf(state, steps.rate(), steps.shift);
      const double excess = inactive_ + volumeAndArea.volume - *volume_;
      if (!(volumeAndArea.area > 0) || std::abs(excess) < kVolumeTolerance * *volume_) break;
      steps.raise(excess / volumeAndArea.area);
    }
    steps.refreshRate();
    const NearSurface near = flow::measureNearSurface(state, steps.rate());
    if (near.weights > 0) steps.shift += near.rates / near.weights;
    steps.refreshRate();
  }

  const CurvatureFlowOptions& options_;
  double voxel_;
  double time_, tolerance_, longest_;
  double now_ = 0, wanted_ = kFirstStep;
  double error_ = 0, longestTaken_ = 0;
  std::array<double, 4> spent_{};
  std::optional<double> volume_;
  double inactive_ = 0;
  CurvatureFlowResult result_;
};

}  // namespace

CurvatureFlowResult curvatureFlow(NarrowBand solid, double time,
                                  const CurvatureFlowOptions& options) {
  checkArguments(solid, time, options);
  if (time == 0) return {.band = std::move(solid)};
  return CurvatureFlow(solid, time, options).run(solid);
}

}  // namespace levelset
