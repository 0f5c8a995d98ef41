#pragma once

#include <cstddef>

#include "levelset/points/point_cloud.h"

namespace levelset {

/// Statistics of the distances from each point to its nearest neighbour, world units. Points at
/// equal positions count as one. All distances are 0 with fewer than two positions.
struct PointSpacing {
  std::size_t duplicates = 0;  ///< number of points at the position of an earlier one
  double mean = 0, median = 0;
  double percentile5 = 0, percentile95 = 0;
  double least = 0, greatest = 0;
};

/// Measures the spacing of a cloud.
/// @throws ResourceLimit, Cancelled
[[nodiscard]] PointSpacing pointSpacing(const PointCloud& cloud,
                                        std::size_t maxMemory = kNoMemoryLimit,
                                        const Progress& progress = {});

/// Returns the points of the given numbers, in this order, with their attributes.
[[nodiscard]] PointCloud selectPoints(const PointCloud& cloud,
                                      const std::vector<std::uint32_t>& numbers);

}  // namespace levelset
