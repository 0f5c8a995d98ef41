#pragma once

#include <optional>

#include "levelset/points/point_cloud.h"

namespace levelset {

struct ThinOptions {
  /// Least distance between two points of the result, world units; empty: `count` is given.
  std::optional<double> radius = {};
  /// Number of points of the result; empty: `radius` is given.
  std::optional<std::size_t> count = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Keeps a part of the points that is spread evenly, without clusters (blue noise). The points keep
/// their order and attributes.
///
/// With `radius`, the result is a Poisson-disk sample: no two points are nearer than the radius,
/// and each removed point is nearer than the radius to a kept one. With `count`, points are removed
/// one after another, each time the one with the most crowded neighbourhood [Yuksel15].
/// @throws UsageError unless exactly one of radius and count is given, and is positive
/// @throws InvalidInput for a cloud without points, or with fewer different positions than `count`
/// @throws ResourceLimit, Cancelled
[[nodiscard]] PointCloud thin(const PointCloud& cloud, const ThinOptions& options);

}  // namespace levelset
