#include "levelset/rbf/rbf_sparse.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cstdint>
#include <vector>

#include "levelset/error.h"
#include "levelset/rbf/rbf_ridge.h"
#include "levelset/rbf/sums/cluster_tree.h"

namespace levelset::rbf {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using SparseMatrix = Eigen::SparseMatrix<double, Eigen::ColMajor, Index>;

constexpr double kEntryBytes = sizeof(double) + sizeof(Index);
constexpr std::size_t kPairLeaf = 16;

/// Sparse Cholesky factors that know their size before they are computed.
class SparseFactors
    : public Eigen::SimplicialLLT<SparseMatrix, Eigen::Lower, Eigen::AMDOrdering<Index>> {
 public:
  /// Number of entries of the factor.
  /// @pre analyzePattern() was called
  [[nodiscard]] Index entries() const { return m_matrix.nonZeros(); }
};

/// Estimates the 1-norm of the inverse of a symmetric matrix from a few solutions [Higham88].
double inverseNorm(const SparseFactors& factors, Index n) {
  VectorXd x = VectorXd::Constant(n, 1.0 / static_cast<double>(n));
  double norm = 0;
  constexpr int kMostSolutions = 5;
  for (int step = 0; step < kMostSolutions; ++step) {
    const VectorXd y = factors.solve(x);
    const double found = y.lpNorm<1>();
    if (step > 0 && !(found > norm)) break;
    norm = found;
    const VectorXd z = factors.solve(VectorXd(y.array().sign()));
    Index at = 0;
    if (z.cwiseAbs().maxCoeff(&at) <= z.dot(x)) break;
    x.setZero();
    x[at] = 1;
  }
  return norm;
}

/// Largest sum of the magnitudes in a column of a symmetric matrix, given its lower triangle.
double normOf(const SparseMatrix& lower) {
  VectorXd sums = VectorXd::Zero(lower.cols());
  for (Index j = 0; j < lower.cols(); ++j)
    for (SparseMatrix::InnerIterator entry(lower, j); entry; ++entry) {
      sums[j] += std::abs(entry.value());
      if (entry.row() != j) sums[entry.row()] += std::abs(entry.value());
    }
  return sums.maxCoeff();
}

}  // namespace

SparseMatrix sparseRbfMatrix(const RbfCloud& cloud, const RbfOptions& options) {
  const std::size_t n = cloud.points.size();
  const ClusterTree tree(cloud.points, kPairLeaf);
  // Rows of the lower triangle of column j, in ascending order.
  const auto rowsOf = [&](std::size_t j) {
    std::vector<std::uint32_t> rows = tree.within(cloud.points[j], 1);
    std::erase_if(rows, [&](std::uint32_t i) { return i < j; });
    std::sort(rows.begin(), rows.end());
    return rows;
  };
  SparseMatrix result(static_cast<Index>(n), static_cast<Index>(n));
  Index* const begin = result.outerIndexPtr();
  tbb::parallel_for(std::size_t{0}, n,
                    [&](std::size_t j) { begin[j + 1] = static_cast<Index>(rowsOf(j).size()); });
  begin[0] = 0;
  for (std::size_t j = 0; j < n; ++j) begin[j + 1] += begin[j];
  withContext("solving the RBF map, whose --support sets the size of the matrix", [&] {
    requireMemory(kEntryBytes * static_cast<double>(begin[n]), options.maxMemory);
  });
  result.resizeNonZeros(begin[n]);
  withKernel(options.kernel, [&](auto k) {
    using Kernel = decltype(k);
    tbb::parallel_for(std::size_t{0}, n, [&](std::size_t j) {
      Index at = begin[j];
      for (const std::uint32_t i : rowsOf(j)) {
        result.innerIndexPtr()[at] = i;
        result.valuePtr()[at] =
            Kernel::kSign * Kernel::value((cloud.points[i] - cloud.points[j]).length()) +
            (i == j ? cloud.lambda[j] : 0);
        ++at;
      }
    });
  });
  return result;
}

RbfFit solveSparsely(const RbfCloud& cloud, const RbfOptions& options, const MatrixXd& polynomial,
                     const RbfColumns& values, RbfSolveReport& report) {
  const auto n = static_cast<Index>(cloud.points.size());
  // The polynomials alone interpolate so few particles.
  if (n == polynomial.cols()) return {RbfColumns::Zero(n, 3), RbfColumns::Zero(n, 3)};
  const SparseMatrix system = sparseRbfMatrix(cloud, options);
  SparseFactors factors;
  factors.analyzePattern(system);
  withContext("solving the RBF map, whose --support sets the size of the factors", [&] {
    requireMemory(kEntryBytes * static_cast<double>(factors.entries() + 2 * system.nonZeros()),
                  options.maxMemory);
  });
  levelset::report(options.progress, 0.1);
  const double norm = normOf(system);
  raiseUntilDefinite(report, [&](double ridge) {
    factors.setShift(ridge * norm);
    factors.factorize(system);
    return factors.info() == Eigen::Success ? 1 / (norm * inverseNorm(factors, n)) : 0;
  });
  levelset::report(options.progress, 0.8);
  // The weights are K⁻¹ (values − P c). They are orthogonal to the polynomials P if
  // Pᵀ K⁻¹ P c = Pᵀ K⁻¹ values.
  const MatrixXd ofPolynomial = factors.solve(polynomial), ofValues = factors.solve(values);
  const MatrixXd complement = polynomial.transpose() * ofPolynomial;
  RbfFit fit;
  fit.weights =
      ofValues - ofPolynomial * complement.ldlt().solve(polynomial.transpose() * ofValues);
  fit.image = system.selfadjointView<Eigen::Lower>() * fit.weights;
  return fit;
}

}  // namespace levelset::rbf
