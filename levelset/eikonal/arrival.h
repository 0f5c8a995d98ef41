#pragma once

#include <cstddef>
#include <span>

#include "levelset/fields/grid.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

/// Arrival times of fronts that move along their normals at a given speed: |∇T| F = 1.
namespace levelset {

enum class FrontMethod {
  /// Fast marching: accepts one grid point after the other in the order of time [Sethian99]; one
  /// thread.
  Marching,
  /// Fast sweeping: solves block by block in alternating directions until nothing changes [Zhao05].
  Sweeping
};

struct ArrivalOptions {
  FrontMethod method = FrontMethod::Sweeping;
  /// Order of the upwind differences, 1 or 2. With 2, a grid point falls back to first order where
  /// no second-order difference is upwind, or where its time would precede those it is computed
  /// from.
  int order = 2;
  /// Speed, world units per unit of time. The front does not pass where the speed is zero,
  /// negative, infinite or NaN. Empty: 1 everywhere.
  ScalarField speed = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct ArrivalFigures {
  std::size_t reached = 0;  ///< grid points that the front reaches before the latest time
  /// Grid points with a start time, near the surface or the source points.
  std::size_t started = 0;
  /// Grid points that fell back from second to first order on one axis or more.
  std::size_t firstOrder = 0;
};

struct ArrivalTimes {
  FieldGrid times;  ///< active where the front arrived; elsewhere the latest time, negated inside
                    ///< the solid
  ArrivalFigures figures;
};

struct FrontDistance {
  NarrowBand band;
  ArrivalFigures figures;
};

/// Computes when a front arrives at the grid points around the surface of `solid`. It starts on the
/// surface at time 0 and moves to both sides; times are negative inside.
/// Within two voxels of the surface, the time is integrated along the straight segment to the
/// closest point of the surface. On segments longer than a voxel, the speed must not vary by more
/// than a factor of two.
/// @param until  the latest time; at speed 1 a distance, world units
/// @throws UsageError for an order other than 1 or 2, or `until` not positive and finite
/// @throws InvalidInput for an empty solid, or when the speed is nowhere positive on its surface
/// @throws ResourceLimit when the blocks that the front reaches do not fit into memory
/// @throws Cancelled
[[nodiscard]] ArrivalTimes arrivalTimes(const NarrowBand& solid, double until,
                                        const ArrivalOptions& options = {});

/// Computes arrival times of a front that starts at points. The grid points are those of `lattice`,
/// whose surface is ignored. Times up to eight voxels from each point are integrated along straight
/// segments, as far as the speed is nearly linear in the position. Where it is not, this start ball
/// has a radius of two voxels. With order 2 the singularity at the nearest point is factored out:
/// at constant speed, times from one point are exact to single precision [Treister16].
/// @throws as arrivalTimes(); UsageError also without a point, for a point that is not finite, or
///         for a `lattice` without a grid
[[nodiscard]] ArrivalTimes arrivalTimesFromPoints(const NarrowBand& lattice,
                                                  std::span<const Imath::V3d> sources, double until,
                                                  const ArrivalOptions& options = {});

/// Computes the distance up to `reach` (world units) on both sides of the surface, with a front
/// instead of closest points. redistance() is more accurate and as fast where the speed is 1.
/// @throws as arrivalTimes(); UsageError also when a speed is set, or `reach` is below one voxel
[[nodiscard]] FrontDistance frontDistance(const NarrowBand& solid, double reach,
                                          const ArrivalOptions& options = {});

/// Options of the operators `fast-marching` and `fast-sweeping`.
struct FrontOptions {
  Length to = Length::voxels(8);
  ScalarField speed;             ///< speed of the front, world units per unit of time
  std::vector<Imath::V3d> from;  ///< start points, world units; empty: the front starts at the
                                 ///< surface of the operand
  int order = 2;
  Attribute extend;

  template <class Visitor>
  static void describe(Visitor& visit) {
    visit("to", &FrontOptions::to,
          {.help = "latest arrival time to compute; at speed 1 the times are distances",
           .unit = OptionUnit::Length,
           .range = OptionRange::Positive});
    visit("speed", &FrontOptions::speed,
          {.help = "speed F of the front, in world units per unit of time; default: 1"});
    visit("from", &FrontOptions::from,
          {.help = "start the front at these points, in place of the surface of the operand, which "
                   "only gives the grid"});
    visit("order", &FrontOptions::order, {{"1", 1}, {"2", 2}},
          {.help = "order of the upwind differences; with 2, a grid point uses first order where "
                   "no second-order difference is upwind"});
    visit("extend", &FrontOptions::extend,
          {.help = "in place of arrival times, compute this attribute of the surface, extended "
                   "along the normals to both sides"});
  }
};

/// Operator that moves a front from a surface or from points.
template <FrontMethod method>
struct FrontOperator {
  using Options = FrontOptions;

  static void check(const Options& options, const GivenOptions& given);
  /// True when the result is a field of times or of the attribute, not a band of distances.
  static bool makesField(const Options& options) {
    return options.speed || !options.from.empty() || options.extend;
  }
  static std::variant<NarrowBand, FieldGrid> run(std::vector<NarrowBand> operands,
                                                 const Options& options, OperatorRun& run);
  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

/// The operator `fast-marching`.
struct FastMarchingOperator : FrontOperator<FrontMethod::Marching> {
  static const OperatorText text;
};
/// The operator `fast-sweeping`.
struct FastSweepingOperator : FrontOperator<FrontMethod::Sweeping> {
  static const OperatorText text;
};

}  // namespace levelset
