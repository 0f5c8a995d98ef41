#include "levelset/terrain/fill_heights.h"

#include <fmt/core.h>

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"

namespace levelset {
namespace {

constexpr std::uint32_t kNoHole = ~std::uint32_t{0};

/// Missing samples that are joined along rows and columns.
struct GroundHole {
  std::vector<std::size_t> samples;  ///< ascending
  double least = std::numeric_limits<double>::infinity(),
         most = -least;  ///< range of the heights beside
};

/// Neighbours of a sample along rows and columns, with their weights.
template <typename Visit>
void forEachNeighbour(const HeightField& field, std::size_t sample, const Visit& visit) {
  const auto width = static_cast<std::size_t>(field.columns);
  const auto column = static_cast<int>(sample % width), row = static_cast<int>(sample / width);
  const double ratio = field.spacing.x / field.spacing.y;
  if (column > 0) visit(sample - 1, 1.0);
  if (column + 1 < field.columns) visit(sample + 1, 1.0);
  if (row > 0) visit(sample - width, ratio * ratio);
  if (row + 1 < field.rows) visit(sample + width, ratio * ratio);
}

/// Finds the hole of a missing sample and numbers its samples in `numbers`.
GroundHole holeAt(const HeightField& field, std::size_t first,
                  std::vector<std::uint32_t>& numbers) {
  GroundHole hole;
  hole.samples.push_back(first);
  numbers[first] = 0;
  for (std::size_t n = 0; n < hole.samples.size(); ++n)
    forEachNeighbour(field, hole.samples[n], [&](std::size_t next, double) {
      const auto height = static_cast<double>(field.heights[next]);
      if (!std::isnan(height)) {
        hole.least = std::min(hole.least, height);
        hole.most = std::max(hole.most, height);
      } else if (numbers[next] == kNoHole) {
        numbers[next] = 0;
        hole.samples.push_back(next);
      }
    });
  std::sort(hole.samples.begin(), hole.samples.end());
  for (std::size_t n = 0; n < hole.samples.size(); ++n)
    numbers[hole.samples[n]] = static_cast<std::uint32_t>(n);
  return hole;
}

/// Solves the equations of a hole. The heights are scaled to [0, 1].
Eigen::VectorXd solveHole(const HeightField& field, const GroundHole& hole,
                          const std::vector<std::uint32_t>& numbers) {
  const auto count = static_cast<Eigen::Index>(hole.samples.size());
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(5 * hole.samples.size());
  Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
  for (Eigen::Index n = 0; n < count; ++n) {
    double sum = 0;
    forEachNeighbour(field, hole.samples[static_cast<std::size_t>(n)],
                     [&](std::size_t next, double weight) {
                       sum += weight;
                       const auto height = static_cast<double>(field.heights[next]);
                       if (std::isnan(height))
                         entries.emplace_back(n, static_cast<Eigen::Index>(numbers[next]), -weight);
                       else
                         right[n] += weight * (height - hole.least) / (hole.most - hole.least);
                     });
    entries.emplace_back(n, n, sum);
  }
  Eigen::SparseMatrix<double> matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  std::vector<Eigen::Triplet<double>>().swap(entries);
  constexpr double kTolerance = 1e-10;
  Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower,
                           Eigen::IncompleteCholesky<double>>
      solver;
  solver.setTolerance(kTolerance);
  solver.setMaxIterations(20 * static_cast<Eigen::Index>(std::sqrt(count) + 50));
  solver.compute(matrix);
  Eigen::VectorXd heights = solver.solve(right);
  if (solver.info() != Eigen::Success)
    throw NumericalError(
        fmt::format("the heights of a hole of {} samples did not converge; fill a smaller part of "
                    "the terrain",
                    count));
  return heights;
}

}  // namespace

HeightField filledHeights(HeightField field, const FillOptions& options) {
  requireHeights(field);
  const std::size_t missing = field.missingCount();
  if (missing == 0) return field;
  if (missing == field.heights.size())
    throw InvalidInput("no sample has data, so there is nothing to fill from; check the file");
  if (missing >= kNoHole)
    throw ResourceLimit("more than 2^32 samples are missing; crop the terrain");
  // The numbers of the samples. Triplets, matrix and factor of a hole take about 300 bytes for each
  // of its samples.
  requireMemory(static_cast<double>(field.heights.size()) * 4 + static_cast<double>(missing) * 300,
                memoryLeft(memoryLimit(options.maxMemory)));
  std::vector<std::uint32_t> numbers(field.heights.size(), kNoHole);
  std::size_t done = 0;
  for (std::size_t sample = 0; sample < field.heights.size(); ++sample) {
    if (!std::isnan(field.heights[sample])) continue;
    const GroundHole hole = holeAt(field, sample, numbers);
    if (hole.most > hole.least) {
      const Eigen::VectorXd heights = solveHole(field, hole, numbers);
      for (std::size_t n = 0; n < hole.samples.size(); ++n) {
        const double share = std::clamp(heights[static_cast<Eigen::Index>(n)], 0.0, 1.0);
        field.heights[hole.samples[n]] =
            static_cast<float>(hole.least + share * (hole.most - hole.least));
      }
    } else {
      for (const std::size_t n : hole.samples) field.heights[n] = static_cast<float>(hole.least);
    }
    done += hole.samples.size();
    report(options.progress, static_cast<double>(done) / static_cast<double>(missing));
  }
  return field;
}

}  // namespace levelset
