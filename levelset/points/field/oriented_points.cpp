#include "levelset/points/field/oriented_points.h"

#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/points/processing/point_neighbours.h"

namespace levelset::points {
namespace {

using Imath::V3d;

/// Number of neighbours that give the spacing.
constexpr std::size_t kSpacingNeighbours = 8;

void requireNormals(const PointCloud& cloud) {
  requirePoints(cloud);
  if (cloud.isEmpty()) throw InvalidInput("the point cloud is empty; give points of a surface");
  if (cloud.normals.empty())
    throw InvalidInput("the point cloud has no normals; compute them with `normals`");
  const auto none = std::count(cloud.normals.begin(), cloud.normals.end(), Imath::V3f(0));
  if (none > 0)
    throw InvalidInput(
        fmt::format("{} of {} points have no normal; remove these points or compute their normals",
                    none, cloud.size()));
}

/// Refuses positions on a line, since they lie on no surface.
void requireSpread(const OrientedPoints& points) {
  if (points.size() < kMinSurfacePoints)
    throw InvalidInput(
        fmt::format("the point cloud has {} different positions; a surface needs at least {}",
                    points.size(), kMinSurfacePoints));
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  const double scale = std::max({points.box.size().x, points.box.size().y, points.box.size().z});
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  const auto at = [&](std::size_t i) {
    const V3d p = points.positions[i] / scale;
    return Eigen::Vector3d(p.x, p.y, p.z);
  };
  for (std::size_t i = 0; i < points.size(); ++i) mean += at(i);
  mean /= static_cast<double>(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    moments += (at(i) - mean) * (at(i) - mean).transpose();
  const Eigen::Vector3d spread =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(moments, Eigen::EigenvaluesOnly).eigenvalues();
  constexpr double kFlat = 1e-14;  // square of a relative width, above rounding
  if (!(spread[1] > kFlat * spread[2]))
    throw InvalidInput("all points lie on one line; give points of a surface");
}

}  // namespace

OrientedPoints orient(const PointCloud& cloud, std::size_t maxMemory) {
  requireNormals(cloud);
  constexpr double kPointBytes = 80;  // positions, normals, sums, spacings and numbers
  requireMemory(
      kPointBytes * static_cast<double>(cloud.size()) + PointNeighbours::bytesFor(cloud.size()),
      memoryLeft(memoryLimit(maxMemory)));
  OrientedPoints points;
  points.centre = bounds(cloud).center();
  std::vector<V3d> relative;
  relative.reserve(cloud.size());
  for (const V3d& p : cloud.positions) relative.push_back(p - points.centre);

  PointNeighbours different(relative);
  std::vector<V3d> sums(cloud.size(), V3d(0));
  for (std::size_t i = 0; i < cloud.size(); ++i)
    sums[different.first(static_cast<std::uint32_t>(i))] += V3d(cloud.normals[i]).normalized();
  for (std::size_t n = 0; n < different.size(); ++n) {
    const std::uint32_t number = different.at(n);
    // Opposite normals cancel out: the first one counts.
    constexpr double kCancelled = 1e-6;
    const V3d sum = sums[number].length() > kCancelled ? sums[number] : V3d(cloud.normals[number]);
    points.positions.push_back(different.positionAt(n));
    points.normals.push_back(sum.normalized());
    points.box.extendBy(different.positionAt(n));
  }
  points.search = std::move(different).takeSearch();
  requireSpread(points);

  points.spacings.resize(points.size());
  std::vector<char> opposes(points.size(), 0);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size()),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      std::vector<FoundItem> found;
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        points.search.closest(points.positions[i], kSpacingNeighbours + 1, found);
                        // The disc to the last neighbour holds half of it: count - 1/2 points with
                        // the first one.
                        const double discArea = std::numbers::pi * found.back().squared;
                        const double area = discArea / (static_cast<double>(found.size()) - 0.5);
                        points.spacings[i] = std::sqrt(area * 2 / std::numbers::sqrt3);
                        V3d mean(0);
                        for (const FoundItem& f : found)
                          mean += f.index == i ? V3d(0) : points.normals[f.index];
                        opposes[i] = mean.dot(points.normals[i]) < 0 ? 1 : 0;
                      }
                    });
  points.opposed = static_cast<std::size_t>(std::count(opposes.begin(), opposes.end(), 1));
  std::vector<double> sorted = points.spacings;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  points.medianSpacing = *middle;
  return points;
}

}  // namespace levelset::points
