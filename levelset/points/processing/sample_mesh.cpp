#include "levelset/points/processing/sample_mesh.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/points/processing/point_spacing.h"
#include "levelset/points/processing/sample_elimination.h"

namespace levelset {
namespace {

using Imath::V3d;

/// Pseudo-random number in (0, 1) for each point and stream.
double uniformNumber(std::uint64_t seed, std::uint64_t point, std::uint64_t stream) {
  const std::uint64_t bits = points::mixed(points::mixed(seed, stream), point);
  return (static_cast<double>(bits >> 12) + 0.5) * 0x1p-52;
}

/// Normally distributed number of variance 1.
double normalNumber(std::uint64_t seed, std::uint64_t point, std::uint64_t stream) {
  const double radius = std::sqrt(-2 * std::log(uniformNumber(seed, point, stream)));
  return radius * std::cos(2 * M_PI * uniformNumber(seed, point, stream + 1));
}

V3d areaVector(const TriMesh& mesh, std::size_t triangle) {
  const auto& corners = mesh.triangles[triangle];
  const V3d& a = mesh.positions[corners[0]];
  return (mesh.positions[corners[1]] - a).cross(mesh.positions[corners[2]] - a) / 2;
}

void checkSampling(const SampleOptions& options) {
  if (options.count.has_value() == options.spacing.has_value())
    throw UsageError("either a count or a spacing is needed; give one of them");
  if (options.count == std::size_t{0})
    throw UsageError("the count is 0; give the number of points");
  if (options.spacing && !(*options.spacing > 0 && std::isfinite(*options.spacing)))
    throw UsageError("the spacing is not a positive number; give a distance between points");
  if (!(options.noise >= 0 && std::isfinite(options.noise)))
    throw UsageError("the noise is negative or not finite; give a length");
}

}  // namespace

PointCloud sampleMesh(const TriMesh& mesh, const SampleOptions& options) {
  checkSampling(options);
  std::vector<double> sums(mesh.triangles.size());
  double area = 0;
  for (std::size_t t = 0; t < sums.size(); ++t) sums[t] = area += areaVector(mesh, t).length();
  if (!(area > 0) || !std::isfinite(area))
    throw InvalidInput("the mesh has no area to place points on; check its triangles");
  const double perPoint = std::sqrt(3.0) / 2;  // area of a point in a hexagonal lattice of edge 1
  const double wanted =
      options.count
          ? static_cast<double>(*options.count)
          : std::max(1.0, std::round(area / (perPoint * *options.spacing * *options.spacing)));
  constexpr double kMost = 4e9, kCandidates = 5, kBytesPerPoint = 70, kBytesPerCandidate = 130;
  if (!(wanted < kMost / kCandidates))
    throw ResourceLimit(
        fmt::format("the surface would take {:.3g} points, more than 8e8; give a smaller count or "
                    "a larger spacing",
                    wanted));
  requireMemory(
      wanted * (kBytesPerPoint + (options.isBlueNoise ? kCandidates * kBytesPerCandidate : 0)),
      memoryLimit(options.maxMemory));
  const auto count = static_cast<std::size_t>(wanted);
  const std::size_t placed =
      options.isBlueNoise ? count * static_cast<std::size_t>(kCandidates) : count;
  PointCloud cloud;
  cloud.positions.resize(placed);
  if (options.hasNormals) cloud.normals.resize(placed);
  tbb::parallel_for(std::size_t{0}, placed, [&](std::size_t i) {
    const double at = uniformNumber(options.seed, i, 0) * area;
    const auto found = std::upper_bound(sums.begin(), sums.end(), at);
    const auto t = static_cast<std::size_t>(
        std::min<std::ptrdiff_t>(found - sums.begin(), std::ssize(sums) - 1));
    const auto& corners = mesh.triangles[t];
    const double root = std::sqrt(uniformNumber(options.seed, i, 1)),
                 share = uniformNumber(options.seed, i, 2);
    cloud.positions[i] = mesh.positions[corners[0]] * (1 - root) +
                         mesh.positions[corners[1]] * (root * (1 - share)) +
                         mesh.positions[corners[2]] * (root * share);
    if (options.hasNormals) cloud.normals[i] = Imath::V3f(areaVector(mesh, t).normalized());
  });
  if (options.isBlueNoise) {
    const double greatest = std::sqrt(area / (perPoint * wanted));
    cloud = selectPoints(
        cloud, points::eliminateSamples(cloud.positions, count, greatest, options.progress));
  }
  if (options.noise > 0)
    tbb::parallel_for(std::size_t{0}, cloud.size(), [&](std::size_t i) {
      for (unsigned axis = 0; axis < 3; ++axis)
        cloud.positions[i][static_cast<int>(axis)] +=
            options.noise * normalNumber(options.seed, i, 3 + 2 * axis);
    });
  return cloud;
}

}  // namespace levelset
