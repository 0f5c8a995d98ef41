#include "levelset/points/processing/thin.h"

#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/points/processing/point_neighbours.h"
#include "levelset/points/processing/point_spacing.h"
#include "levelset/points/processing/sample_elimination.h"

namespace levelset {
namespace {

/// Estimates the area of the surface that the points lie on, from the discs that hold k neighbours.
double diskArea(const points::PointNeighbours& tree) {
  constexpr std::size_t kNeighbours = 8;
  std::vector<double> areas(tree.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tree.size(), 4096), [&](const auto& range) {
    std::vector<points::Neighbour> found;
    for (std::size_t n = range.begin(); n < range.end(); ++n) {
      tree.nearest(tree.positionAt(n), kNeighbours + 1, found);
      if (found.size() > 1)
        areas[n] = M_PI * found.back().squared / static_cast<double>(found.size() - 1);
    }
  });
  double sum = 0;
  for (const double area : areas) sum += area;
  return sum;
}

}  // namespace

PointCloud thin(const PointCloud& cloud, const ThinOptions& options) {
  if (options.radius.has_value() == options.count.has_value())
    throw UsageError("either a radius or a count is needed; give one of them");
  if (options.radius && !(*options.radius > 0 && std::isfinite(*options.radius)))
    throw UsageError("the radius is not a positive number; give a distance between points");
  if (options.count == std::size_t{0})
    throw UsageError("the count is 0; give the number of points to keep");
  requirePoints(cloud);
  if (cloud.isEmpty()) throw InvalidInput("the point cloud has no points; read another file");
  constexpr double kBytesPerPoint = 150;
  requireMemory(kBytesPerPoint * static_cast<double>(cloud.size()), memoryLimit(options.maxMemory));
  if (options.radius)
    return selectPoints(cloud,
                        points::poissonDisk(cloud.positions, *options.radius, options.progress));
  const std::size_t count = *options.count;
  double greatest = 0;
  {
    const points::PointNeighbours tree(cloud.positions);
    if (tree.size() < count)
      throw InvalidInput(
          fmt::format("the point cloud has {} different positions, fewer than the {} points to "
                      "keep; give a smaller count",
                      tree.size(), count));
    if (tree.size() == count) {
      std::vector<std::uint32_t> all;
      for (std::size_t n = 0; n < tree.size(); ++n) all.push_back(tree.at(n));
      std::sort(all.begin(), all.end());
      return selectPoints(cloud, all);
    }
    greatest = std::sqrt(2 * diskArea(tree) / (std::sqrt(3.0) * static_cast<double>(count)));
  }
  return selectPoints(cloud,
                      points::eliminateSamples(cloud.positions, count, greatest, options.progress));
}

}  // namespace levelset
