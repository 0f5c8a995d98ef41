#pragma once

// Internal header of levelset: public headers must not include it.

#include <span>

#include "levelset/eikonal/arrival_blocks.h"

namespace levelset::eikonal {

/// At an index position; kFar where nothing passes. Safe to call from many threads.
using Slowness = std::function<double(const openvdb::Vec3d&)>;

/// Second-order differences read two grid points back: that far the start is given, voxels.
inline constexpr double kStartWidth = 2;

/// Where a front starts, before it is solved for.
struct ArrivalStart {
  const char* action = "fast-sweeping";
  Slowness slowness = {};  ///< empty: 1 everywhere
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Times along the straight way to the closest point of the zero set, up to two voxels from it.
/// What the straight way may be wrong about is left out: the solver goes there.
[[nodiscard]] std::vector<StartTime> startAtSurface(const openvdb::FloatGrid& field,
                                                    const ArrivalStart& start);

/// The same around points (index space); up to eight voxels, as far as the speed is about linear
/// all around.
[[nodiscard]] std::vector<StartTime> startAtPoints(std::span<const openvdb::Vec3d> points,
                                                   const ArrivalStart& start);

/// What an active grid point beside the zero set has for slowness, by the median of some: by this
/// times are scaled. 1 where nothing passes.
[[nodiscard]] double typicalSlowness(const openvdb::FloatGrid& field, const Slowness& slowness);
[[nodiscard]] double typicalSlowness(std::span<const openvdb::Vec3d> points,
                                     const Slowness& slowness);

}  // namespace levelset::eikonal
