#include "levelset/rbf/rbf_cloud.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "levelset/error.h"
#include "levelset/rbf/sums/cluster_tree.h"

namespace levelset::rbf {
namespace {

using Imath::V3d;

// Two particles closer than this share of the cloud's size give matrix rows that are equal within
// rounding errors.
constexpr double kSmallestGap = 1e-9;
// A cloud flatter than this share of its size leaves the map's gradient across it undetermined.
constexpr double kFlattest = 1e-6;
// Targets of coincident particles that differ by less than this share of the extent of all targets
// count as equal.
constexpr double kSameTarget = 1e-9;
constexpr std::size_t kNeighbourLeaf = 16;

bool isFinite(const V3d& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

double largest(const V3d& p) {
  return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
}

void checkArguments(std::span<const V3d> points, std::span<const V3d> targets,
                    std::span<const char> near, const RbfOptions& options) {
  for (const double lambda : {options.lambdaNear, options.lambdaFar}) {
    if (!(lambda >= 0) || !std::isfinite(lambda)) {
      throw UsageError(fmt::format("λ is {}; give a relaxation of at least 0", lambda));
    }
  }
  if (isCompact(options.kernel) && (!(options.support > 1) || !std::isfinite(options.support))) {
    throw UsageError(
        fmt::format("the support radius is {} mean particle spacings; give more than 1, so that "
                    "particles reach their neighbours",
                    options.support));
  }
  if (points.size() != targets.size() || points.size() != near.size()) {
    throw InvalidInput(fmt::format("{} points, {} targets and {} flags; give equal numbers",
                                   points.size(), targets.size(), near.size()));
  }
  if (points.empty()) {
    throw InvalidInput("there are no particles; give at least one");
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!isFinite(points[i]) || !isFinite(targets[i])) {
      throw InvalidInput(
          fmt::format("particle {} at ({}, {}, {}) is not finite; give finite positions and values",
                      i, points[i].x, points[i].y, points[i].z));
    }
  }
}

/// Mean of the points, and the largest |coordinate| relative to it.
std::pair<V3d, double> centreOf(std::span<const V3d> points) {
  V3d mean(0);
  for (const V3d& p : points) mean += p / static_cast<double>(points.size());
  double extent = 0;
  for (const V3d& p : points) extent = std::max(extent, largest(p - mean));
  return {mean, extent};
}

/// For each point, the index of the first point that coincides with it. The group of coincident
/// points becomes one particle.
std::vector<std::uint32_t> findLeaders(std::span<const V3d> points, double gap) {
  std::vector<std::uint32_t> order(points.size()), leader(points.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](std::uint32_t i) {
    return std::tuple(points[i].x, points[i].y, points[i].z, i);
  };
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return key(a) < key(b); });
  // Equal points are grouped first, so that many of them do not make the search below quadratic.
  std::vector<std::uint32_t> distinct;
  for (const std::uint32_t i : order) {
    if (distinct.empty() || points[distinct.back()] != points[i]) distinct.push_back(i);
    leader[i] = distinct.back();
  }
  std::sort(distinct.begin(), distinct.end());
  std::vector<V3d> places;
  for (const std::uint32_t i : distinct) places.push_back(points[i]);
  const ClusterTree tree(places, kNeighbourLeaf);
  std::vector<std::uint32_t> first(points.size(), static_cast<std::uint32_t>(points.size()));
  for (std::uint32_t n = 0; n < places.size(); ++n) {
    if (first[distinct[n]] < points.size()) continue;
    for (const std::uint32_t other : tree.within(places[n], gap)) {
      std::uint32_t& at = first[distinct[other]];
      if (at == points.size()) at = distinct[n];
    }
  }
  for (std::uint32_t& i : leader) i = first[i];
  return leader;
}

/// Mean distance of a point to its nearest neighbour, and mean distance between the targets of a
/// point and of its nearest neighbour.
std::pair<double, double> meanSpacings(std::span<const V3d> points, std::span<const V3d> targets) {
  const ClusterTree tree(points, kNeighbourLeaf);
  std::vector<std::uint32_t> nearest(points.size());
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
    nearest[i] = tree.nearest(static_cast<std::uint32_t>(i));
  });
  double spacing = 0, step = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    spacing += (points[i] - points[nearest[i]]).length();
    step += (targets[i] - targets[nearest[i]]).length();
  }
  const auto count = static_cast<double>(points.size());
  return {spacing / count, step / count};
}

/// Particles with distinct positions; targets of coincident points are averaged.
struct Merged {
  std::vector<V3d> points, targets;
  std::vector<char> near;
  std::vector<std::uint32_t> place;  ///< index in `points` of each original particle
  /// For each merged particle, the index of the original particle whose position it gets.
  std::vector<std::uint32_t> leader;
};

Merged mergeCoincident(std::span<const V3d> points, std::span<const V3d> targets,
                       std::span<const char> near, double gap) {
  const std::vector<std::uint32_t> leader = findLeaders(points, gap);
  Merged merged;
  merged.place.resize(points.size());
  std::vector<double> count;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (leader[i] == i) {
      merged.place[i] = static_cast<std::uint32_t>(merged.points.size());
      merged.points.push_back(points[i]);
      merged.leader.push_back(static_cast<std::uint32_t>(i));
      merged.targets.emplace_back(0);
      merged.near.push_back(0);
      count.push_back(0);
    }
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint32_t place = merged.place[i] = merged.place[leader[i]];
    count[place] += 1;
    if (near[i]) merged.near[place] = 1;
  }
  for (std::size_t i = 0; i < points.size(); ++i)
    merged.targets[merged.place[i]] += targets[i] / count[merged.place[i]];
  // Targets of particles that were not merged keep their bits.
  for (std::size_t i = 0; i < points.size(); ++i)
    if (count[merged.place[i]] == 1) merged.targets[merged.place[i]] = targets[i];
  return merged;
}

/// Counts the merged particles, and rejects coincident particles whose targets differ too much.
void checkMerged(const Merged& merged, std::span<const V3d> points, std::span<const V3d> targets,
                 double targetSpacing, RbfSolveReport& report) {
  if (merged.points.size() == points.size()) return;
  const double same = kSameTarget * centreOf(targets).second;
  std::vector<char> differs(merged.points.size(), 0);
  double worst = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const V3d& mean = merged.targets[merged.place[i]];
    const double off = (targets[i] - mean).length();
    worst = std::max(worst, off);
    if (off > same) differs[merged.place[i]] = 1;
    if (off > std::max(targetSpacing, same)) {
      throw InvalidInput(fmt::format(
          "particles at ({:.6g}, {:.6g}, {:.6g}) coincide, but the values "
          "({:.6g}, {:.6g}, {:.6g}) of one differ from those of the others "
          "by more than neighbours do; remove one of them",
          points[i].x, points[i].y, points[i].z, targets[i].x, targets[i].y, targets[i].z));
    }
  }
  std::vector<char> isTaken(merged.points.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint32_t place = merged.place[i];
    if (isTaken[place]) (differs[place] ? report.averaged : report.merged) += 1;
    isTaken[place] = 1;
  }
  if (report.merged > 0) {
    report.notes.push_back(fmt::format(
        "{} particles share the position and values of another and were left out", report.merged));
  }
  if (report.averaged > 0) {
    report.notes.push_back(fmt::format(
        "{} particles share the position of another and were averaged with it; values differ "
        " from the mean by up to {:.3g}",
        report.averaged, worst));
  }
}

/// Computes the principal axes of the points, the widest first, and counts the axes along which the
/// points have a width.
void findAxes(RbfCloud& cloud, RbfSolveReport& report) {
  if (cloud.points.size() > 1) {
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const V3d& p : cloud.points) {
      const V3d q = p / cloud.extent;
      const Eigen::Vector3d v(q.x, q.y, q.z);
      spread += v * v.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
    for (int n = 0; n < 3; ++n) {
      const Eigen::Vector3d axis = solver.eigenvectors().col(2 - n);
      cloud.axes[static_cast<std::size_t>(n)] = V3d(axis[0], axis[1], axis[2]);
      // Eigenvalues are squared lengths with the rounding error of the largest, so the width is
      // measured.
      double width = 0;
      for (const V3d& p : cloud.points)
        width = std::max(width, std::abs(p.dot(cloud.axes[static_cast<std::size_t>(n)])));
      if (width > kFlattest * cloud.extent) cloud.directions = n + 1;
    }
  }
  report.directions = cloud.directions;
  constexpr std::array<const char*, 3> kShapes = {
      "there is only one particle, so the map is constant",
      "all particles lie on one line, so the map rotates and scales space as it does the line",
      "all particles lie in one plane, so the map continues along the plane's normal, scaled by "
      "the mean scale in the plane"};
  if (cloud.directions < 3)
    report.notes.emplace_back(kShapes[static_cast<std::size_t>(cloud.directions)]);
}

}  // namespace

RbfCloud makeRbfCloud(std::span<const V3d> points, std::span<const V3d> targets,
                      std::span<const char> near, const RbfOptions& options,
                      RbfSolveReport& report) {
  checkArguments(points, targets, near, options);
  RbfCloud cloud;
  const auto [origin, extent] = centreOf(points);
  const auto [targetOrigin, targetExtent] = centreOf(targets);
  if (!std::isfinite(extent) || !std::isfinite(targetExtent)) {
    throw InvalidInput(
        "the distance between particles overflows double precision; use a larger "
        "unit of length");
  }
  cloud.origin = origin;
  // Points scaled to size 1, so that no square overflows.
  std::vector<V3d> local;
  for (const V3d& p : points) local.push_back(extent > 0 ? (p - origin) / extent : V3d(0));
  Merged merged = mergeCoincident(local, targets, near, kSmallestGap);
  const auto [spacing, targetSpacing] = meanSpacings(merged.points, merged.targets);
  checkMerged(merged, points, targets, targetSpacing, report);
  cloud.spacing = merged.points.size() > 1 ? spacing * extent : 1;
  cloud.unit = cloud.spacing * (isCompact(options.kernel) ? options.support : 1);
  cloud.targets = std::move(merged.targets);
  for (const std::uint32_t i : merged.leader) {
    // The same expression as in RbfFunction, so that the positions match to the last bit.
    cloud.points.push_back((points[i] - origin) / cloud.unit);
    cloud.extent = std::max(cloud.extent, largest(cloud.points.back()));
  }
  for (const char isNear : merged.near)
    cloud.lambda.push_back(isNear ? options.lambdaNear : options.lambdaFar);
  findAxes(cloud, report);
  return cloud;
}

}  // namespace levelset::rbf
