#include "levelset/rbf/rbf_krylov.h"

#include <fmt/core.h>

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "levelset/error.h"
#include "levelset/rbf/rbf_precondition.h"
#include "levelset/rbf/sums/cluster_tree.h"
#include "levelset/rbf/sums/rbf_cluster_sum.h"

namespace levelset::rbf {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Imath::V3d;

constexpr std::size_t kSolveLeaf = 128;
constexpr Index kMostSteps = 40;  // largest number of steps between restarts
constexpr int kMostRestarts = 30;
// The iteration stagnates if a restart does not reduce the residual below this share of its
// previous value.
constexpr double kStill = 0.7;
// Smallest ratio of the residual after a restart to that before, at which a restart aims. The fast
// sum is not accurate enough for a smaller ratio.
constexpr double kLeastReduction = 1e-3;

/// True if the kernel grows so fast that the fast sum is too inaccurate, because far particles
/// outweigh near ones.
bool growsFast(RbfKernel kernel) {
  return kernel == RbfKernel::Triharmonic || kernel == RbfKernel::ThinPlate ||
         kernel == RbfKernel::Sum;
}

/// Reorders the particles by the order of a ClusterTree, so that the particles of each tree node
/// are contiguous.
RbfCloud inOrder(const RbfCloud& cloud, std::span<const std::uint32_t> order) {
  RbfCloud result = cloud;
  for (std::size_t n = 0; n < order.size(); ++n) {
    result.points[n] = cloud.points[order[n]];
    result.targets[n] = cloud.targets[order[n]];
    result.lambda[n] = cloud.lambda[order[n]];
  }
  return result;
}

template <typename Matrix>
Matrix rowsInOrder(const Matrix& matrix, std::span<const std::uint32_t> order) {
  Matrix result(matrix.rows(), matrix.cols());
  for (std::size_t n = 0; n < order.size(); ++n)
    result.row(static_cast<Index>(n)) = matrix.row(order[n]);
  return result;
}

/// Least-squares problem of GMRES for one right-hand side. Columns of the Hessenberg matrix are
/// added one by one.
class Hessenberg {
 public:
  explicit Hessenberg(double residual) : right_(Eigen::VectorXd::Zero(kMostSteps + 1)) {
    right_[0] = residual;
  }
  /// Adds a column.
  /// @param column  dot products of the new Krylov vector with the basis, then the norm of its
  ///         remainder; one value more than the basis has vectors
  void push(Eigen::VectorXd column) {
    plain_.topRows(column.size()).col(steps_) = column;
    for (Index i = 0; i < steps_; ++i) rotate(i, column[i], column[i + 1]);
    const double length = std::hypot(column[steps_], column[steps_ + 1]);
    cosine_[steps_] = length > 0 ? column[steps_] / length : 1;
    sine_[steps_] = length > 0 ? column[steps_ + 1] / length : 0;
    rotate(steps_, column[steps_], column[steps_ + 1]);
    rotate(steps_, right_[steps_], right_[steps_ + 1]);
    triangle_.topRows(steps_ + 1).col(steps_) = column.head(steps_ + 1);
    ++steps_;
  }
  [[nodiscard]] double residual() const { return std::abs(right_[steps_]); }
  [[nodiscard]] Eigen::VectorXd solve() const {
    Eigen::VectorXd result = right_.head(steps_);
    for (Index i = steps_; i-- > 0;) {
      for (Index j = i + 1; j < steps_; ++j) result[i] -= triangle_(i, j) * result[j];
      // An exhausted Krylov space gives a zero column, which gets the coefficient 0.
      result[i] = triangle_(i, i) != 0 ? result[i] / triangle_(i, i) : 0;
    }
    return result;
  }
  /// Ratio of the largest to the smallest singular value: the condition number on the Krylov space.
  [[nodiscard]] double condition() const {
    const Eigen::JacobiSVD<MatrixXd> svd(plain_.topLeftCorner(steps_ + 1, steps_));
    const auto& values = svd.singularValues();
    return values[steps_ - 1] > 0 ? values[0] / values[steps_ - 1] : 0;
  }

 private:
  void rotate(Index i, double& a, double& b) const {
    const double first = cosine_[i] * a + sine_[i] * b;
    b = cosine_[i] * b - sine_[i] * a;
    a = first;
  }
  Index steps_ = 0;
  Eigen::VectorXd right_;
  MatrixXd plain_ = MatrixXd::Zero(kMostSteps + 1, kMostSteps),
           triangle_ = MatrixXd::Zero(kMostSteps + 1, kMostSteps);
  std::array<double, kMostSteps> cosine_{}, sine_{};
};

/// Flexible GMRES for the three right-hand sides u, v and w in lockstep.
///
/// Eigen has GMRES only in unsupported/, without a flexible variant. It preconditions from the
/// left, so its tolerance bounds the preconditioned residual. It assumes a linear preconditioner,
/// but RbfPreconditioner solves its leaves in single precision and is linear only to that
/// precision. It also takes one right-hand side at a time, while here one fast sum serves u, v and
/// w.
class KrylovSolver {
 public:
  KrylovSolver(const RbfCloud& cloud, const RbfOptions& options, const MatrixXd& q,
               const ClusterTree& tree, RbfSolveReport& report)
      : cloud_(cloud),
        options_(options),
        q_(q),
        sign_(withKernel(options.kernel, [](auto k) { return decltype(k)::kSign; })),
        sum_(options.kernel, cloud.points, tree.nodes()),
        inverse_(cloud, options.kernel, tree, q),
        isDirect_(growsFast(options.kernel)),
        report_(report) {}

  /// Solves for the weights.
  /// @param tolerance  largest accepted magnitude of the residual's entries, in u, v and w
  RbfFit solve(const RbfColumns& values, double tolerance) {
    const RbfColumns right = project(values), zero = RbfColumns::Zero(values.rows(), 3);
    RbfFit fit{zero, zero};
    RbfColumns residual = right;
    double worst = residual.cwiseAbs().maxCoeff();
    for (int restart = 0; worst > tolerance; ++restart) {
      fit.weights += correct(residual, std::max(kLeastReduction, 0.3 * tolerance / worst));
      fit.image = multiplyDirectly(cloud_, options_.kernel, fit.weights);
      residual = right - project(fit.image);
      const double before = worst;
      worst = residual.cwiseAbs().maxCoeff();
      if (worst <= tolerance) break;
      const bool isStill = !(worst < kStill * before);
      if ((isStill && isDirect_) || restart >= kMostRestarts) refuse(worst, tolerance);
      // The residual may stagnate because of the errors of the fast sum, so matrix products then
      // use direct sums.
      if (isStill) isDirect_ = true;
    }
    return fit;
  }

 private:
  [[noreturn]] void refuse(double worst, double tolerance) const {
    throw NumericalError(fmt::format(
        "after {} iterations for {} particles the residual stagnates at {:.3g}, but {:.3g} is "
        "required; use a larger λ, more evenly spaced particles, the "
        "biharmonic kernel or a larger tolerance",
        report_.iterations, cloud_.points.size(), worst, tolerance));
  }

  [[nodiscard]] RbfColumns project(const RbfColumns& values) const {
    return values - q_ * (q_.transpose() * values);
  }

  [[nodiscard]] RbfColumns multiply(const RbfColumns& weights) const {
    if (isDirect_) return project(multiplyDirectly(cloud_, options_.kernel, weights));
    const std::size_t n = cloud_.points.size();
    std::vector<V3d> rows(n);
    for (std::size_t i = 0; i < n; ++i) {
      const auto row = weights.row(static_cast<Index>(i));
      rows[i] = V3d(row[0], row[1], row[2]);
    }
    const std::vector<V3d> sums = sum_(rows);
    RbfColumns result(weights.rows(), 3);
    for (std::size_t i = 0; i < n; ++i) {
      const auto row = static_cast<Index>(i);
      for (int k = 0; k < 3; ++k)
        result(row, k) = sign_ * sums[i][k] + cloud_.lambda[i] * weights(row, k);
    }
    return project(result);
  }

  /// Computes weights that reduce the residual to about `reduction` times its norm.
  RbfColumns correct(const RbfColumns& residual, double reduction) {
    std::vector<RbfColumns> basis = {residual}, searched;
    std::vector<Hessenberg> problems;
    std::array<double, 3> goal{};
    for (int k = 0; k < 3; ++k) {
      const double length = residual.col(k).norm();
      problems.emplace_back(length);
      goal[static_cast<std::size_t>(k)] = reduction * length;
      if (length > 0) basis[0].col(k) /= length;
    }
    const auto isDone = [&] {
      for (std::size_t k = 0; k < 3; ++k)
        if (problems[k].residual() > goal[k]) return false;
      return true;
    };
    while (!isDone() && static_cast<Index>(searched.size()) < kMostSteps) {
      searched.push_back(inverse_(basis.back()));
      basis.push_back(multiply(searched.back()));
      for (int k = 0; k < 3; ++k)
        problems[static_cast<std::size_t>(k)].push(orthogonalize(basis, k));
      ++report_.iterations;
      const double done = static_cast<double>(report_.iterations);
      levelset::report(options_.progress, 0.1 + 0.8 * done / (done + 20));
    }
    return combine(searched, problems);
  }

  /// Orthogonalises column k of the last basis matrix against the previous ones, twice, and
  /// normalises it.
  static Eigen::VectorXd orthogonalize(std::vector<RbfColumns>& basis, int k) {
    const std::size_t last = basis.size() - 1;
    Eigen::VectorXd products = Eigen::VectorXd::Zero(static_cast<Index>(last) + 1);
    auto column = basis[last].col(k);
    for (int pass = 0; pass < 2; ++pass)
      for (std::size_t j = 0; j < last; ++j) {
        const double product = basis[j].col(k).dot(column);
        products[static_cast<Index>(j)] += product;
        column -= product * basis[j].col(k);
      }
    const double length = column.norm();
    products[static_cast<Index>(last)] = length;
    if (length > 0) column /= length;
    return products;
  }

  RbfColumns combine(const std::vector<RbfColumns>& searched,
                     const std::vector<Hessenberg>& problems) {
    RbfColumns weights = RbfColumns::Zero(q_.rows(), 3);
    for (int k = 0; k < 3 && !searched.empty(); ++k) {
      const Hessenberg& problem = problems[static_cast<std::size_t>(k)];
      const Eigen::VectorXd share = problem.solve();
      for (std::size_t j = 0; j < searched.size(); ++j)
        weights.col(k) += share[static_cast<Index>(j)] * searched[j].col(k);
      report_.condition = std::max(report_.condition, problem.condition());
    }
    return weights;
  }

  const RbfCloud& cloud_;
  const RbfOptions& options_;
  const MatrixXd& q_;
  double sign_;
  RbfClusterSum sum_;
  RbfPreconditioner inverse_;
  bool isDirect_;  ///< true: matrix products use direct sums instead of the fast sum
  RbfSolveReport& report_;
};

}  // namespace

RbfFit solveIteratively(const RbfCloud& cloud, const RbfOptions& options, const MatrixXd& q,
                        const RbfColumns& values, RbfSolveReport& report) {
  const auto n = static_cast<double>(cloud.points.size());
  const double basis = 2.0 * kMostSteps * sizeof(double) * 3;
  constexpr double kSumBytes = 500;  // per particle, for the tree nodes of the fast sum
  withContext("solving the RBF map", [&] {
    requireMemory(n * (basis + kSumBytes) + RbfPreconditioner::estimateBytes(n), options.maxMemory);
  });
  const ClusterTree first(cloud.points, kSolveLeaf);
  const std::vector<std::uint32_t> order(first.order().begin(), first.order().end());
  const RbfCloud ordered = inOrder(cloud, order);
  const MatrixXd orderedQ = rowsInOrder(q, order);
  const ClusterTree tree = first.inOrder(ordered.points);
  const Eigen::RowVector3d mean = values.colwise().mean();
  const double extent = (values.rowwise() - mean).cwiseAbs().maxCoeff();
  KrylovSolver solver(ordered, options, orderedQ, tree, report);
  const RbfFit fit = solver.solve(rowsInOrder(values, order), options.solveTolerance * extent);
  RbfFit result{RbfColumns(fit.weights.rows(), 3), RbfColumns(fit.weights.rows(), 3)};
  for (std::size_t i = 0; i < order.size(); ++i) {
    result.weights.row(order[i]) = fit.weights.row(static_cast<Index>(i));
    result.image.row(order[i]) = fit.image.row(static_cast<Index>(i));
  }
  return result;
}

}  // namespace levelset::rbf
