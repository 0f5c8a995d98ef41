#pragma once

#include <cstddef>
#include <span>

#include "levelset/fields/grid.h"
#include "levelset/narrow_band.h"
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
  /// the second-order difference is not upwind.
  int order = 2;
  /// Speed, world units per unit of time. The front does not pass where it is zero, negative or
  /// NaN. Empty: 1.
  ScalarField speed = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct ArrivalFigures {
  std::size_t reached = 0;  ///< grid points with a time
  std::size_t started = 0;  ///< grid points whose time the start gives
  /// Grid points that fell back from second to first order on one axis or more.
  std::size_t firstOrder = 0;
};

struct ArrivalTimes {
  FieldGrid times;  ///< active where the front arrived; elsewhere ± the latest time
  ArrivalFigures figures;
};

struct FrontDistance {
  NarrowBand band;
  ArrivalFigures figures;
};

/// Computes when a front arrives at the grid points around the surface of `solid`. It starts on the
/// surface at time 0 and moves to both sides; times are negative inside.
/// Within two voxels of the surface the time is that along the straight segment to the closest
/// point, where the speed on the segment varies little.
/// @param until  the latest time; at speed 1 a distance, world units
/// @throws UsageError for an order other than 1 or 2, or `until` not positive and finite
/// @throws InvalidInput for an empty solid, or when the speed is nowhere positive on its surface
/// @throws ResourceLimit when the blocks that the front reaches do not fit into memory
/// @throws Cancelled
[[nodiscard]] ArrivalTimes arrivalTimes(const NarrowBand& solid, double until,
                                        const ArrivalOptions& options = {});

/// Computes arrival times of a front that starts at points, on the grid of `lattice` (the solid
/// itself does not count).
/// Within eight voxels of each point the start is exact, as far as the speed is about linear in all
/// directions. Elsewhere the front starts as a ball of about two voxels. With order 2 the
/// singularity at the nearest point is factored out: at constant speed, times from one point are
/// exact to float [Treister16].
/// @throws UsageError also when there is no point, or one that is not finite
[[nodiscard]] ArrivalTimes arrivalTimesFromPoints(const NarrowBand& lattice,
                                                  std::span<const Imath::V3d> sources, double until,
                                                  const ArrivalOptions& options = {});

/// Computes the distance up to `reach` (world units) on both sides of the surface, with a front
/// instead of closest points. redistance() is more accurate and as fast where the speed is 1.
/// @throws UsageError also when a speed is set, or `reach` is below one voxel
[[nodiscard]] FrontDistance frontDistance(const NarrowBand& solid, double reach,
                                          const ArrivalOptions& options = {});

}  // namespace levelset
