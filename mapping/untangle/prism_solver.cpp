#include "mapping/untangle/prism_solver.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <limits>

#include "mapping/surface/surface_field.h"

namespace mapping {
namespace {

using Imath::V3d;

// Number of pairs of step and gradient change that L-BFGS keeps.
constexpr std::size_t kRemembered = 8;
// Least decrease of the energy in a step, as a share of the decrease that its slope along the step
// predicts (Armijo).
constexpr double kSufficient = 1e-4;
constexpr int kMostHalvings = 30;
constexpr double kLongestStep = 0.5;  // longest step of a particle, particle spacings
constexpr double kStandsStill = 1e-7;
// A step gains nothing if it decreases the energy by less than this share; kNoGainSteps such steps
// in a row end the search.
constexpr double kNoGain = 1e-11;
constexpr int kNoGainSteps = 5;
// Second derivative of the symmetric Dirichlet energy with respect to the slopes, for the
// undeformed (rest) shape.
constexpr double kStiffness = 8;

double innerProduct(const std::vector<V3d>& a, const std::vector<V3d>& b) {
  double sum = 0;
  for (std::size_t n = 0; n < a.size(); ++n) sum += a[n].dot(b[n]);
  return sum;
}

void addScaled(std::vector<V3d>& a, const std::vector<V3d>& b, double factor) {
  for (std::size_t n = 0; n < a.size(); ++n) a[n] += b[n] * factor;
}

}  // namespace

/// Factorised Laplacian matrix of the elements, over the particles that are not fixed.
struct PrismSolver::Preconditioner {
  std::vector<int> unknown;  ///< row of each particle in the matrix; −1: fixed
  int count = 0;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor;

  Preconditioner(const PrismElements& elements, const std::vector<ParticleHold>& holds) {
    for (const ParticleHold hold : holds)
      unknown.push_back(hold == ParticleHold::Fixed ? -1 : count++);
    std::vector<Eigen::Triplet<double>> triplets;
    double trace = 0;
    for (std::size_t e = 0; e < elements.size(); ++e)
      elements.forEachEntry(e, [&](const PrismElements::Entry& a) {
        const int row = unknown[a.particle];
        if (row < 0) return;
        elements.forEachEntry(e, [&](const PrismElements::Entry& b) {
          const int column = unknown[b.particle];
          const double value = kStiffness * elements.weight(e) * a.slope.dot(b.slope);
          if (column >= 0 && column <= row) triplets.emplace_back(row, column, value);
          if (column == row) trace += value;
        });
      });
    // The shift of the diagonal keeps the matrix regular when no particle is fixed.
    constexpr double kShift = 1e-6;
    for (int n = 0; n < count; ++n) triplets.emplace_back(n, n, kShift * trace / count);
    Eigen::SparseMatrix<double> matrix(count, count);
    matrix.setFromTriplets(triplets.begin(), triplets.end());
    factor.compute(matrix);
  }
};

/// L-BFGS memory: recent steps and the changes of the gradient over them.
struct PrismSolver::Memory {
  struct Pair {
    Vectors step, change;
    double product;
  };
  std::deque<Pair> pairs;

  void add(Vectors step, Vectors change) {
    const double product = innerProduct(step, change);
    const double lengths =
        std::sqrt(innerProduct(step, step)) * std::sqrt(innerProduct(change, change));
    if (!(product > 1e-10 * lengths)) return;
    if (pairs.size() == kRemembered) pairs.pop_front();
    pairs.push_back({std::move(step), std::move(change), product});
  }

  /// Applies the approximate inverse Hessian to `vectors`; `start` applies the approximate inverse
  /// from which the updates begin.
  template <typename Start>
  Vectors apply(Vectors vectors, const Start& start) const {
    std::vector<double> alpha(pairs.size());
    for (std::size_t n = pairs.size(); n-- > 0;) {
      alpha[n] = innerProduct(pairs[n].step, vectors) / pairs[n].product;
      addScaled(vectors, pairs[n].change, -alpha[n]);
    }
    Vectors result = start(std::move(vectors));
    if (!pairs.empty()) {
      const Pair& last = pairs.back();
      const double scale = last.product / innerProduct(last.change, start(last.change));
      if (std::isfinite(scale) && scale > 0)
        for (V3d& v : result) v *= scale;
    }
    for (std::size_t n = 0; n < pairs.size(); ++n) {
      const double beta = innerProduct(pairs[n].change, result) / pairs[n].product;
      addScaled(result, pairs[n].step, alpha[n] - beta);
    }
    return result;
  }
};

PrismSolver::PrismSolver(const levelset::NarrowBand& base, const PrismElements& elements,
                         std::vector<ParticleHold> holds, std::vector<V3d> positions)
    : base_(base),
      elements_(elements),
      holds_(std::move(holds)),
      positions_(std::move(positions)),
      normals_(positions_.size(), V3d(0)),
      preconditioner_(std::make_unique<Preconditioner>(elements, holds_)) {
  // An element's slopes are differences divided by its edge lengths at rest, so the mean of the
  // steepest is 1 / spacing.
  double steepness = 0;
  for (std::size_t e = 0; e < elements_.size(); ++e) {
    double steepest = 0;
    elements_.forEachEntry(e, [&](const PrismElements::Entry& entry) {
      for (int axis = 0; axis < 3; ++axis)
        steepest = std::max(steepest, std::abs(entry.slope[axis]));
    });
    steepness += elements_.weight(e) * steepest;
  }
  spacing_ = 1 / steepness;
  updateNormals();
}

PrismSolver::~PrismSolver() = default;

double PrismSolver::energyAt(const Density& density, const Vectors& positions,
                             std::vector<ElementSlopes>* stress) const {
  std::vector<double> values(elements_.size());
  if (stress) stress->resize(elements_.size());
  tbb::parallel_for(std::size_t{0}, elements_.size(), [&](std::size_t e) {
    const ElementEnergy energy = density(elements_.slopes(e, positions));
    values[e] = energy.value;
    if (stress) (*stress)[e] = energy.stress;
  });
  double sum = 0;
  for (std::size_t e = 0; e < values.size(); ++e) sum += elements_.weight(e) * values[e];
  return std::isfinite(sum) ? sum : std::numeric_limits<double>::infinity();
}

double PrismSolver::energy(const Density& density) const {
  return energyAt(density, positions_, nullptr);
}

double PrismSolver::leastDeterminant() const {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t e = 0; e < elements_.size(); ++e)
    least = std::min(least, determinantOf(elements_.slopes(e, positions_)));
  return least;
}

void PrismSolver::updateNormals() {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, holds_.size(), 256), [&](const auto& range) {
    const SurfaceField field(base_);
    for (std::size_t n = range.begin(); n != range.end(); ++n)
      if (holds_[n] == ParticleHold::Slides) normals_[n] = field.normal(positions_[n]);
  });
}

void PrismSolver::makeTangent(Vectors& vectors) const {
  for (std::size_t n = 0; n < vectors.size(); ++n) {
    if (holds_[n] == ParticleHold::Fixed) vectors[n] = V3d(0);
    if (holds_[n] == ParticleHold::Slides) vectors[n] -= normals_[n] * normals_[n].dot(vectors[n]);
  }
}

PrismSolver::Vectors PrismSolver::gradientOf(const std::vector<ElementSlopes>& stress) const {
  Vectors gradient = elements_.gather(stress);
  makeTangent(gradient);
  return gradient;
}

PrismSolver::Vectors PrismSolver::preconditioned(Vectors vectors) const {
  makeTangent(vectors);
  Eigen::MatrixXd right(preconditioner_->count, 3);
  const std::vector<int>& unknown = preconditioner_->unknown;
  for (std::size_t n = 0; n < vectors.size(); ++n)
    if (unknown[n] >= 0) right.row(unknown[n]) << vectors[n].x, vectors[n].y, vectors[n].z;
  const Eigen::MatrixXd solved = preconditioner_->factor.solve(right);
  for (std::size_t n = 0; n < vectors.size(); ++n)
    if (unknown[n] >= 0)
      vectors[n] = V3d(solved(unknown[n], 0), solved(unknown[n], 1), solved(unknown[n], 2));
  makeTangent(vectors);
  return vectors;
}

bool PrismSolver::moved(const Vectors& direction, double step, Vectors& result) const {
  result.resize(positions_.size());
  std::atomic<bool> isOn = true;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, holds_.size(), 256), [&](const auto& range) {
    const SurfaceField field(base_);
    for (std::size_t n = range.begin(); n != range.end(); ++n) {
      result[n] = positions_[n] + direction[n] * step;
      if (holds_[n] == ParticleHold::Slides && !field.project(result[n], 0)) isOn = false;
    }
  });
  return isOn;
}

std::size_t PrismSolver::minimise(const Density& density, std::size_t mostIterations) {
  if (preconditioner_->count == 0) return 0;
  Memory memory;
  std::vector<ElementSlopes> stress;
  double energy = energyAt(density, positions_, &stress);
  Vectors gradient = gradientOf(stress), next;
  const auto start = [&](Vectors vectors) { return preconditioned(std::move(vectors)); };
  std::size_t iterations = 0;
  for (int still = 0; iterations < mostIterations && still < kNoGainSteps;) {
    Vectors direction = memory.apply(gradient, start);
    makeTangent(direction);
    for (V3d& d : direction) d = -d;
    const double slope = innerProduct(direction, gradient);
    double longest = 0;
    for (const V3d& d : direction) longest = std::max(longest, d.length());
    if (!(slope < 0) || !std::isfinite(longest)) {
      if (memory.pairs.empty()) break;
      memory.pairs.clear();
      continue;
    }
    if (longest < kStandsStill * spacing_) break;
    double step = std::min(1.0, kLongestStep * spacing_ / longest), reached = energy;
    bool isBetter = false;
    for (int halving = 0; halving < kMostHalvings && !isBetter; ++halving, step *= 0.5) {
      if (!moved(direction, step, next)) continue;
      reached = energyAt(density, next, &stress);
      isBetter = reached <= energy + kSufficient * step * slope;
    }
    if (!isBetter) {
      if (memory.pairs.empty()) break;
      memory.pairs.clear();
      continue;
    }
    Vectors offset = next, change = gradient;
    addScaled(offset, positions_, -1);
    positions_.swap(next);
    updateNormals();
    gradient = gradientOf(stress);
    for (std::size_t n = 0; n < change.size(); ++n) change[n] = gradient[n] - change[n];
    makeTangent(offset);
    makeTangent(change);
    memory.add(std::move(offset), std::move(change));
    still = energy - reached < kNoGain * energy ? still + 1 : 0;
    energy = reached;
    ++iterations;
  }
  return iterations;
}

}  // namespace mapping
