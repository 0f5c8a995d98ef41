#pragma once

// Internal header of levelset: public headers must not include it.

#include <span>

#include "levelset/eikonal/arrival_blocks.h"

namespace levelset::eikonal {

/// Slowness at an index position; kFar where the front cannot pass. Safe to call from many threads.
using Slowness = std::function<double(const openvdb::Vec3d&)>;

/// Distance from the surface or source point, in voxels, up to which start times are integrated
/// along straight segments. Second-order differences read two grid points towards the start.
inline constexpr double kStartWidth = 2;

/// Options for computing the times at which a front starts.
struct ArrivalStart {
  Slowness slowness = {};  ///< slowness of the front; empty: 1 everywhere
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Computes start times along straight segments to the closest points of the zero set, up to two
/// voxels from it. Leaves out grid points whose segment may not be the fastest path: the solver
/// computes their times.
[[nodiscard]] std::vector<StartTime> startAtSurface(const openvdb::FloatGrid& field,
                                                    const ArrivalStart& start);

/// Computes start times around points (index space), up to eight voxels away where the speed is
/// about linear in all directions.
[[nodiscard]] std::vector<StartTime> startAtPoints(std::span<const openvdb::Vec3d> points,
                                                   const ArrivalStart& start);

/// Returns the median slowness over a sample of active grid points beside the zero set. The solver
/// scales times by it. Returns 1 when the front can pass at none of the samples.
[[nodiscard]] double typicalSlowness(const openvdb::FloatGrid& field, const Slowness& slowness);
[[nodiscard]] double typicalSlowness(std::span<const openvdb::Vec3d> points,
                                     const Slowness& slowness);

}  // namespace levelset::eikonal
