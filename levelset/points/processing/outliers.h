#pragma once

#include "levelset/points/point_cloud.h"

namespace levelset {

struct OutlierOptions {
  int neighbours = 16;  ///< number of nearest points that decide on a point, from 1 to 1000
  /// Number of standard deviations above the median at which a point is an outlier, > 0.
  double deviations = 6;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Result of withoutOutliers().
struct OutlierResult {
  PointCloud cloud;
  std::size_t removed = 0;
  double limit = 0;  ///< greatest accepted mean distance to the neighbours, world units
};

/// Removes points whose mean distance to their nearest neighbours is far above that of the other
/// points. The standard deviation is estimated by the median of the deviations from the median, so
/// that the outliers themselves do not change it; it is at least a tenth of the median. Points at
/// equal positions count as one.
/// @throws UsageError for options outside their range
/// @throws InvalidInput for a cloud without points
/// @throws ResourceLimit, Cancelled
[[nodiscard]] OutlierResult withoutOutliers(const PointCloud& cloud,
                                            const OutlierOptions& options = {});

}  // namespace levelset
