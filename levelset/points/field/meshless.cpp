#include "levelset/points/field/meshless.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/SparseCore>
#include <algorithm>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"

namespace levelset::points {
namespace {

using Imath::V3d;
using MeshlessMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor, std::int64_t>;

constexpr double kMeshlessRowBytes = 16;     // of each entry of the matrix
constexpr double kMeshlessPointBytes = 100;  // vectors of the solver

struct MeshlessPlanes {
  const OrientedPoints* points;
  std::vector<double> constants;  // of each point, world units

  double operator()(const V3d& at, const std::vector<FoundItem>& found) const {
    const double squaredCutOff = found.back().squared;
    double sum = 0, weights = 0;
    for (std::size_t n = 0; n + 1 < found.size(); ++n) {
      const FoundItem& f = found[n];
      const double weight = pointWeight(f.squared / squaredCutOff);
      weights += weight;
      sum += weight * plane(f.index, at);
    }
    // All neighbours may lie at the cut-off.
    return weights > 0 ? sum / weights : plane(found.front().index, at);
  }
  [[nodiscard]] double plane(std::uint32_t index, const V3d& at) const {
    return constants[index] + points->normals[index].dot(at - points->positions[index]);
  }
};

struct MeshlessSystem {
  MeshlessMatrix matrix;
  Eigen::VectorXd right;
};

MeshlessSystem meshlessSystem(const OrientedPoints& points, std::size_t perRow) {
  const std::size_t count = points.size();
  MeshlessSystem system;
  system.right.resize(static_cast<Eigen::Index>(count));
  // Every row has as many entries, so that rows are filled in parallel.
  MeshlessMatrix& matrix = system.matrix;
  matrix.resize(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(count));
  matrix.resizeNonZeros(static_cast<Eigen::Index>(count * perRow));
  for (std::size_t j = 0; j <= count; ++j)
    matrix.outerIndexPtr()[j] = static_cast<std::int64_t>(j * perRow);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count), [&](const auto& range) {
    std::vector<FoundItem> found;
    for (std::size_t j = range.begin(); j < range.end(); ++j) {
      const V3d& at = points.positions[j];
      points.search.closest(at, perRow + 1, found);
      const double squaredCutOff = found.back().squared;
      found.pop_back();
      std::sort(found.begin(), found.end(),
                [](const FoundItem& a, const FoundItem& b) { return a.index < b.index; });
      double sum = 0, weights = 0;
      for (const FoundItem& f : found) weights += pointWeight(f.squared / squaredCutOff);
      for (std::size_t n = 0; n < found.size(); ++n) {
        const std::uint32_t i = found[n].index;
        const double weight = pointWeight(found[n].squared / squaredCutOff) / weights;
        matrix.innerIndexPtr()[j * perRow + n] = i;
        matrix.valuePtr()[j * perRow + n] = weight;
        sum -= weight * points.normals[i].dot(at - points.positions[i]);
      }
      system.right[static_cast<Eigen::Index>(j)] = sum;
    }
  });
  return system;
}

/// Minimises |A c − b|² + damping² |c|² by conjugate gradients on the normal equations.
Eigen::VectorXd solveDamped(const MeshlessSystem& system) {
  constexpr double kSquaredDamping = 0.01;  // see meshless.h
  constexpr int kMostIterations = 500;
  constexpr double kTolerance = 1e-8;  // of the gradient
  Eigen::VectorXd solution = Eigen::VectorXd::Zero(system.right.size()), residual = system.right,
                  gradient = system.matrix.transpose() * residual, direction = gradient;
  double squared = gradient.squaredNorm();
  const double target = kTolerance * kTolerance * squared;
  for (int n = 0; n < kMostIterations && squared > target; ++n) {
    const Eigen::VectorXd image = system.matrix * direction;
    const double step = squared / (image.squaredNorm() + kSquaredDamping * direction.squaredNorm());
    solution += step * direction;
    residual -= step * image;
    gradient = system.matrix.transpose() * residual - kSquaredDamping * solution;
    const double before = squared;
    squared = gradient.squaredNorm();
    direction = gradient + squared / before * direction;
  }
  return solution;
}

}  // namespace

PointField meshless(const OrientedPoints& points, std::size_t neighbours, std::size_t maxMemory,
                    const Progress& progress) {
  const std::size_t count = points.size();
  neighbours = std::min(neighbours, count - 1);
  requireMemory((kMeshlessRowBytes * static_cast<double>(neighbours) + kMeshlessPointBytes) *
                    static_cast<double>(count),
                memoryLeft(memoryLimit(maxMemory)));
  const MeshlessSystem system = meshlessSystem(points, neighbours);
  report(progress, 0.5);
  const Eigen::VectorXd constants = solveDamped(system);
  report(progress, 1);
  return {MeshlessPlanes{&points, {constants.begin(), constants.end()}}, neighbours + 1};
}

}  // namespace levelset::points
