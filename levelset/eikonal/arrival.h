#pragma once

#include <cstddef>
#include <span>

#include "levelset/fields/grid.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

/// Fronts that move along their normals at a given speed: |∇T| F = 1.
namespace levelset {

enum class FrontMethod {
  Marching,  ///< one grid point after the other in the order of time [Sethian99]; one thread
  Sweeping   ///< block by block in alternating directions until nothing changes [Zhao05]
};

struct ArrivalOptions {
  FrontMethod method = FrontMethod::Sweeping;
  /// 1, or 2: second-order differences, per grid point back to first where they are not upwind.
  int order = 2;
  /// World units per unit of time. Where it is zero, negative or NaN, nothing passes. Empty: 1.
  ScalarField speed = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct ArrivalFigures {
  std::size_t reached = 0;  ///< grid points with a time
  std::size_t started = 0;  ///< of them, given by the start
  /// Of them, fell back to first order, on one axis or more, where the second was asked.
  std::size_t firstOrder = 0;
};

struct ArrivalTimes {
  FieldGrid times;  ///< active where the front came; elsewhere ± the latest time
  ArrivalFigures figures;
};

struct FrontDistance {
  NarrowBand band;
  ArrivalFigures figures;
};

/// When a front that starts on the surface of `solid` at time 0 and moves to both sides comes to
/// the grid points around it. Negative inside. Within two voxels of the surface the start is the
/// time along the straight way to the closest point, as far as the speed on it is much the same.
/// @param until  the latest time; at speed 1 a distance, world units
/// @throws UsageError for an order other than 1 or 2, or `until` not positive and finite;
///         InvalidInput for an empty solid, or when the speed is nowhere positive on its surface;
///         ResourceLimit; Cancelled
[[nodiscard]] ArrivalTimes arrivalTimes(const NarrowBand& solid, double until,
                                        const ArrivalOptions& options = {});

/// The same from points, on the grid points of `lattice` (its solid does not count). The start is
/// exact within eight voxels of each point, as far as the speed is about linear all around; where
/// it is not, the front starts as a ball of about two voxels. In second order the singularity at
/// the nearest point is taken apart: at constant speed times from one point are exact to float
/// [Treister16].
/// @throws UsageError also when there is no point, or one that is not finite
[[nodiscard]] ArrivalTimes arrivalTimesFromPoints(const NarrowBand& lattice,
                                                  std::span<const Imath::V3d> sources, double until,
                                                  const ArrivalOptions& options = {});

/// The distance to `reach` (world units) on both sides, by front instead of by closest points;
/// redistance() is more exact and as fast where the speed is 1.
/// @throws UsageError also when a speed is set, or `reach` is below one voxel
[[nodiscard]] FrontDistance frontDistance(const NarrowBand& solid, double reach,
                                          const ArrivalOptions& options = {});

/// Options of the operators `fast-marching` and `fast-sweeping`.
struct FrontOptions {
  Length to = Length::voxels(8);
  ScalarField speed;             ///< world units per unit of time
  std::vector<Imath::V3d> from;  ///< world units; empty: the surface
  int order = 2;
  Attribute extend;

  template <class Visitor>
  static void describe(Visitor& visit) {
    visit("to", &FrontOptions::to,
          {.help = "latest time, which at speed 1 is a distance",
           .unit = OptionUnit::Length,
           .range = OptionRange::Positive});
    visit("speed", &FrontOptions::speed,
          {.help = "F, in world units per unit of time; default: 1"});
    visit("from", &FrontOptions::from,
          {.help = "start at these points, on the grid of the operand, in place of its surface"});
    visit("order", &FrontOptions::order, {{"1", 1}, {"2", 2}},
          {.help = "order of the differences; 2 falls back to 1 where it must"});
    visit("extend", &FrontOptions::extend,
          {.help = "in place of times: this attribute, carried off the surface along its normals"});
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
