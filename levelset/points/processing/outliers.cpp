#include "levelset/points/processing/outliers.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/points/processing/point_neighbours.h"
#include "levelset/points/processing/point_spacing.h"
#include "levelset/progress_gate.h"

namespace levelset {
namespace {

double medianOf(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

OutlierResult withoutOutliers(const PointCloud& cloud, const OutlierOptions& options) {
  if (options.neighbours < 1)
    throw UsageError("the number of neighbours is below 1; give a positive number");
  points::requireNeighbours(options.neighbours);
  if (!(options.deviations > 0) || !std::isfinite(options.deviations))
    throw UsageError("the number of deviations is not positive; give a positive number");
  requirePoints(cloud);
  if (cloud.isEmpty()) throw InvalidInput("the point cloud has no points; read another file");
  const auto n = static_cast<double>(cloud.size());
  requireMemory(points::PointNeighbours::bytesFor(cloud.size()) + 2 * sizeof(double) * n,
                memoryLimit(options.maxMemory));
  const points::PointNeighbours tree(cloud.positions);
  const std::size_t wanted =
      std::min(static_cast<std::size_t>(options.neighbours), tree.size() - 1);
  if (wanted == 0) return {cloud, 0, std::numeric_limits<double>::infinity()};
  std::vector<double> means(tree.size());
  ProgressGate gate(options.progress, tree.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tree.size(), 4096), [&](const auto& range) {
    std::vector<points::Neighbour> found;
    for (std::size_t at = range.begin(); at < range.end(); ++at) {
      tree.nearest(tree.positionAt(at), wanted + 1, found);
      double sum = 0;
      for (const points::Neighbour& other : found) sum += std::sqrt(other.squared);
      means[at] = sum / static_cast<double>(wanted);
    }
    gate.advance(range.size());
  });
  // The median absolute deviation of normally distributed values, times this factor, is their
  // standard deviation.
  constexpr double kNormalFactor = 1.4826;
  constexpr double kLeastShare = 0.1;
  const double median = medianOf(means);
  std::vector<double> deviations = means;
  for (double& value : deviations) value = std::abs(value - median);
  const double deviation =
      std::max(kNormalFactor * medianOf(std::move(deviations)), kLeastShare * median);
  OutlierResult result;
  result.limit = median + options.deviations * deviation;
  std::vector<char> isKept(cloud.size(), 0);
  for (std::size_t at = 0; at < tree.size(); ++at) isKept[tree.at(at)] = means[at] <= result.limit;
  std::vector<std::uint32_t> kept;
  for (std::size_t i = 0; i < cloud.size(); ++i)
    if (isKept[tree.first(static_cast<std::uint32_t>(i))])
      kept.push_back(static_cast<std::uint32_t>(i));
  result.removed = cloud.size() - kept.size();
  result.cloud = selectPoints(cloud, kept);
  return result;
}

}  // namespace levelset
