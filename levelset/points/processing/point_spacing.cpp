#include "levelset/points/processing/point_spacing.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "levelset/memory/memory_limit.h"
#include "levelset/points/processing/point_neighbours.h"
#include "levelset/progress_gate.h"

namespace levelset {
namespace {

template <typename T>
std::vector<T> selectFrom(const std::vector<T>& all, const std::vector<std::uint32_t>& numbers) {
  std::vector<T> chosen;
  if (all.empty()) return chosen;
  chosen.reserve(numbers.size());
  for (const std::uint32_t number : numbers) chosen.push_back(all[number]);
  return chosen;
}

/// Value that the given share of a list does not exceed. Reorders the list.
double percentile(std::vector<double>& values, double share) {
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

}  // namespace

PointSpacing pointSpacing(const PointCloud& cloud, std::size_t maxMemory,
                          const Progress& progress) {
  requireMemory(points::PointNeighbours::bytesFor(cloud.size()) +
                    static_cast<double>(cloud.size() * sizeof(double)),
                memoryLimit(maxMemory));
  const points::PointNeighbours tree(cloud.positions);
  PointSpacing spacing;
  spacing.duplicates = tree.duplicates();
  if (tree.size() < 2) return spacing;
  std::vector<double> distances(tree.size());
  ProgressGate gate(progress, tree.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tree.size(), 4096), [&](const auto& range) {
    std::vector<points::Neighbour> found;
    for (std::size_t n = range.begin(); n < range.end(); ++n) {
      tree.nearest(tree.positionAt(n), 2, found);
      distances[n] = std::sqrt(found[1].squared);
    }
    gate.advance(range.size());
  });
  double sum = 0;
  for (const double distance : distances) sum += distance;
  spacing.mean = sum / static_cast<double>(distances.size());
  spacing.least = percentile(distances, 0);
  spacing.percentile5 = percentile(distances, 0.05);
  spacing.median = percentile(distances, 0.5);
  spacing.percentile95 = percentile(distances, 0.95);
  spacing.greatest = percentile(distances, 1);
  return spacing;
}

PointCloud selectPoints(const PointCloud& cloud, const std::vector<std::uint32_t>& numbers) {
  PointCloud chosen;
  chosen.positions = selectFrom(cloud.positions, numbers);
  chosen.normals = selectFrom(cloud.normals, numbers);
  chosen.colors = selectFrom(cloud.colors, numbers);
  chosen.radii = selectFrom(cloud.radii, numbers);
  chosen.weights = selectFrom(cloud.weights, numbers);
  chosen.precision = cloud.precision;
  return chosen;
}

}  // namespace levelset
