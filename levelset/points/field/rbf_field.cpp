#include "levelset/points/field/rbf_field.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/rbf/rbf_function.h"
#include "levelset/rbf/rbf_taylor.h"

namespace levelset::points {
namespace {

using Imath::V3d;
using rbf::RbfCube;
using rbf::RbfCubes;
using rbf::RbfFunction;

/// Particles of the function: the centres, and the places beside them.
struct Particles {
  std::vector<V3d> positions, values;
  void add(const V3d& position, double value) {
    positions.push_back(position);
    values.emplace_back(value, 0, 0);
  }
  [[nodiscard]] double extent() const {
    double largest = 0;
    for (const V3d& value : values) largest = std::max(largest, std::abs(value.x));
    return largest;
  }
};

/// Distance from a point along its normal, or against it, at which the point is still the closest
/// one. Farther away, another sheet may be nearer.
/// @param side  1 or −1
/// @return 0 where there is no such distance
double clearance(const OrientedPoints& points, std::uint32_t point, double side) {
  constexpr double kShare = 0.5;  // of the spacing
  constexpr int kHalvings = 4;
  double distance = kShare * points.spacings[point];
  for (int n = 0; n < kHalvings; ++n, distance /= 2) {
    const V3d at = points.positions[point] + side * distance * points.normals[point];
    const FoundItem found = points.search.closest(at, std::numeric_limits<double>::infinity());
    if (found.index == point) return distance;
  }
  return 0;
}

Particles particlesOf(const OrientedPoints& points, const std::vector<bool>& isCentre) {
  std::vector<std::uint32_t> centres;
  for (std::uint32_t i = 0; i < points.size(); ++i)
    if (isCentre[i]) centres.push_back(i);
  std::vector<std::array<double, 2>> clear(centres.size());
  tbb::parallel_for(std::size_t{0}, centres.size(), [&](std::size_t i) {
    clear[i] = {clearance(points, centres[i], 1), clearance(points, centres[i], -1)};
  });
  Particles particles;
  for (std::size_t i = 0; i < centres.size(); ++i) {
    const std::uint32_t point = centres[i];
    particles.add(points.positions[point], 0);
    for (const int side : {0, 1}) {
      const double distance = (side == 0 ? 1 : -1) * clear[i][static_cast<std::size_t>(side)];
      if (distance != 0)
        particles.add(points.positions[point] + distance * points.normals[point], distance);
    }
  }
  return particles;
}

/// Largest edge of a leaf, median spacings. A leaf of two spacings has about 200 near particles.
constexpr double kLeafEdge = 3;
/// Distance from the points within which leaves are made, median spacings. Positions beyond it are
/// in larger cubes, with more near particles.
constexpr double kLeafReach = 2;

/// Evaluates the function at positions near the points. Particles far from a cube are summed into a
/// polynomial, which its octants inherit.
class CubeTree {
 public:
  /// @throws ResourceLimit, Cancelled
  CubeTree(const RbfFunction& function, const OrientedPoints& points, std::size_t maxMemory,
           const Progress& progress)
      : cubes_(function, V3d(1), std::numeric_limits<double>::infinity()),
        origin_(function.origin()),
        leafHalf_(kLeafEdge * points.medianSpacing / 2) {
    // The field is used up to about five spacings from the points.
    constexpr double kMargin = 6;
    const V3d size = points.box.size();
    const double half = 0.5 * std::max({size.x, size.y, size.z}) +
                        kMargin * *std::max_element(points.spacings.begin(), points.spacings.end());
    nodes_.push_back({cubes_.root(points.box.center() - origin_, half), {}});
    for (std::size_t begin = 0; begin < nodes_.size();) {
      begin = splitLevel(begin, points, maxMemory);
      report(progress, 1);
    }
  }

  [[nodiscard]] double value(const V3d& at) const {
    const V3d local = at - origin_;
    std::size_t n = 0;
    while (nodes_[n].children[0] != 0)
      n = nodes_[n].children[static_cast<std::size_t>(octantOf(nodes_[n].cube, local))];
    return cubes_.value(nodes_[n].cube, local).x;
  }

 private:
  struct Node {
    RbfCube cube;
    std::array<std::uint32_t, 8> children;  ///< 0: none
  };

  static int octantOf(const RbfCube& cube, const V3d& at) {
    return (at.x > cube.center.x ? 1 : 0) | (at.y > cube.center.y ? 2 : 0) |
           (at.z > cube.center.z ? 4 : 0);
  }
  [[nodiscard]] bool isSplit(const RbfCube& cube, const OrientedPoints& points) const {
    if (cube.half <= leafHalf_) return false;
    const FoundItem found =
        points.search.closest(cube.center + origin_, std::numeric_limits<double>::infinity());
    return std::sqrt(found.squared) < cube.radius() + kLeafReach * points.medianSpacing;
  }
  /// Splits the nodes from a number on.
  /// @return number of nodes before
  std::size_t splitLevel(std::size_t begin, const OrientedPoints& points, std::size_t maxMemory) {
    const std::size_t end = nodes_.size();
    // The octants of each node are made from its near particles, and the nodes are copied once.
    std::vector<char> divides(end - begin);
    tbb::parallel_for(begin, end,
                      [&](std::size_t n) { divides[n - begin] = isSplit(nodes_[n].cube, points); });
    double bytes = 2.0 * sizeof(Node) * static_cast<double>(end);
    for (std::size_t n = begin; n < end; ++n)
      if (divides[n - begin])
        bytes += 8 * (3.0 * sizeof(Node) +
                      sizeof(std::uint32_t) * static_cast<double>(nodes_[n].cube.near.size()));
    requireMemory(bytes, memoryLeft(memoryLimit(maxMemory)));
    std::vector<std::vector<RbfCube>> octants(end - begin);
    tbb::parallel_for(begin, end, [&](std::size_t n) {
      if (!divides[n - begin]) return;
      RbfCube& cube = nodes_[n].cube;
      for (int bits = 0; bits < 8; ++bits) octants[n - begin].push_back(cubes_.octant(cube, bits));
      cube.near = {};
    });
    for (std::size_t n = begin; n < end; ++n) {
      for (std::size_t bits = 0; bits < octants[n - begin].size(); ++bits) {
        nodes_[n].children[bits] = static_cast<std::uint32_t>(nodes_.size());
        nodes_.push_back({std::move(octants[n - begin][bits]), {}});
      }
    }
    return end;
  }

  RbfCubes cubes_;
  V3d origin_;
  double leafHalf_;
  std::vector<Node> nodes_;
};

/// Distances of the points from the surface, about: values of the function, whose slope is 1.
std::vector<double> residualsOf(const OrientedPoints& points, const CubeTree& tree) {
  std::vector<double> residuals(points.size());
  constexpr std::size_t kChunk = 64;
  tbb::parallel_for(std::size_t{0}, (points.size() + kChunk - 1) / kChunk, [&](std::size_t chunk) {
    for (std::size_t i = chunk * kChunk; i < std::min((chunk + 1) * kChunk, points.size()); ++i)
      residuals[i] = std::abs(tree.value(points.positions[i]));
  });
  return residuals;
}

/// Makes centres of the points that lie farther than the tolerance from the surface, the farthest
/// first, but only one of several neighbours.
/// @return number of new centres
std::size_t addCentres(const OrientedPoints& points, const std::vector<double>& residuals,
                       double tolerance, std::vector<bool>& isCentre) {
  constexpr std::size_t kNeighbours = 4;  // the point itself is one
  std::vector<std::uint32_t> far;
  for (std::uint32_t i = 0; i < points.size(); ++i)
    if (residuals[i] > tolerance && !isCentre[i]) far.push_back(i);
  std::stable_sort(far.begin(), far.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return residuals[a] > residuals[b]; });
  std::vector<bool> isBeside(points.size(), false);
  std::vector<FoundItem> found;
  std::size_t count = 0;
  for (const std::uint32_t i : far) {
    if (isBeside[i]) continue;
    isCentre[i] = true;
    ++count;
    points.search.closest(points.positions[i], kNeighbours, found);
    for (const FoundItem& f : found) isBeside[f.index] = true;
  }
  return count;
}

/// Fits the function. The messages of the solver are those of texture maps.
RbfFunction solve(const Particles& particles, std::size_t centres, const rbf::RbfOptions& options) {
  const std::vector<char> near(particles.positions.size(), 1);
  try {
    return RbfFunction(particles.positions, particles.values, near, options);
  } catch (const NumericalError& error) {
    throw NumericalError(
        fmt::format("the radial function of {} points has no solution ({}); raise --fit-error or "
                    "--lambda, thin the points, or use --method mls",
                    centres, error.what()));
  }
}

}  // namespace

PointField rbfField(const OrientedPoints& points, const RbfFieldOptions& options) {
  constexpr std::size_t kFirst = 4000;  // centres of the first function
  constexpr double kSolveShare = 0.1;   // of the tolerance
  constexpr double kReach = 2;
  // The order of the search tree spreads every n-th point evenly.
  const std::size_t step = (points.size() + kFirst - 1) / kFirst;
  std::vector<bool> isCentre(points.size(), false);
  for (std::size_t i = 0; i < points.size(); i += step) isCentre[i] = true;
  rbf::RbfOptions fit;
  constexpr std::size_t kDense = 1000;  // a direct solution takes longer for more
  fit.denseLimit = kDense;
  fit.lambdaNear = fit.lambdaFar = options.lambda;
  fit.maxMemory = options.maxMemory;
  // Error of the linear system that is accepted. Only the last function needs the tolerance.
  double aim = step == 1 ? options.tolerance : points.medianSpacing;
  for (double done = 0;; done = 0.5 + done / 2) {
    const Particles particles = particlesOf(points, isCentre);
    fit.solveTolerance = std::clamp(kSolveShare * aim / particles.extent(), 1e-9, 1e-2);
    fit.progress = subProgress(options.progress, done, 0.5 + done / 2);
    const auto centres =
        static_cast<std::size_t>(std::count(isCentre.begin(), isCentre.end(), true));
    const RbfFunction function = solve(particles, centres, fit);
    const auto tree =
        std::make_shared<const CubeTree>(function, points, options.maxMemory, fit.progress);
    const std::vector<double> residuals = residualsOf(points, *tree);
    const std::size_t added = addCentres(points, residuals, options.tolerance, isCentre);
    if (added > 0)
      // The next function reduces the largest residual to about a third.
      aim =
          std::max(options.tolerance, 0.2 * *std::max_element(residuals.begin(), residuals.end()));
    else if (aim > options.tolerance)
      aim = options.tolerance;
    else
      return {[tree](const V3d& at, const std::vector<FoundItem>& /*found*/) {
                return tree->value(at);
              },
              1, kReach, centres};
  }
}

}  // namespace levelset::points
