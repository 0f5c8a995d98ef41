#include "levelset/rbf/rbf_precondition.h"

#include <tbb/parallel_for.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "levelset/rbf/sums/rbf_sum.h"

namespace levelset::rbf {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Imath::V3d;

// Number of neighbouring particles that are solved together with those of a leaf.
constexpr std::size_t kAround = 150;
// Number of particles for each particle of the coarse subset, until the subset has kMostCoarse
// particles.
constexpr std::size_t kCoarseShare = 40;
constexpr std::size_t kMostCoarse = 2500;
constexpr std::size_t kCoarseTile = 64;
// Smallest shift of a matrix's diagonal, as a share of its mean, if the matrix is not positive
// definite because particles are close together.
constexpr double kRidge = 1e-12;

/// Cholesky factors of a symmetric matrix. If it is not positive definite within rounding errors,
/// its diagonal is increased.
Eigen::LLT<MatrixXd> factor(MatrixXd system) {
  const double mean = system.rows() > 0 ? system.diagonal().cwiseAbs().mean() : 0;
  for (double ridge = kRidge;; ridge *= 100) {
    Eigen::LLT<MatrixXd> factors(system);
    if (factors.info() == Eigen::Success || ridge > 1) return factors;
    system.diagonal().array() += ridge * mean;
  }
}

/// An orthonormal basis whose first columns span the linear polynomials' values at the chosen
/// particles, and the number of these columns.
std::pair<MatrixXd, Index> basisOf(const MatrixXd& q, std::span<const std::uint32_t> chosen) {
  MatrixXd polynomial(static_cast<Index>(chosen.size()), q.cols());
  for (std::size_t i = 0; i < chosen.size(); ++i)
    polynomial.row(static_cast<Index>(i)) = q.row(chosen[i]);
  Eigen::ColPivHouseholderQR<MatrixXd> qr(polynomial);
  qr.setThreshold(1e-9);
  return {MatrixXd(qr.householderQ()), qr.rank()};
}

}  // namespace

RbfPreconditioner::RbfPreconditioner(const RbfCloud& cloud, RbfKernel kernel,
                                     const ClusterTree& tree, const MatrixXd& q)
    : cloud_(cloud), kernel_(kernel), q_(q) {
  for (const ClusterTree::Node& node : tree.nodes())
    if (node.isLeaf()) leaves_.push_back({node.begin, node.end, {}, {}});
  tbb::parallel_for(std::size_t{0}, leaves_.size(),
                    [&](std::size_t n) { makeLeaf(tree, leaves_[n]); });
  chooseCoarse();
  factorCoarse();
}

double RbfPreconditioner::estimateBytes(double particles) {
  const double coarse = std::min(particles / kCoarseShare, static_cast<double>(kMostCoarse));
  constexpr double kMatrices = 5;  // matrices of the coarse subset during factorisation
  return particles * (3.0 * kAround * sizeof(float) + 100) +
         kMatrices * coarse * coarse * sizeof(double);
}

void RbfPreconditioner::makeLeaf(const ClusterTree& tree, Leaf& leaf) const {
  const Index own = leaf.end - leaf.begin;
  leaf.members.resize(static_cast<std::size_t>(own));
  std::iota(leaf.members.begin(), leaf.members.end(), leaf.begin);
  Imath::Box3d box;
  for (const std::uint32_t i : leaf.members) box.extendBy(cloud_.points[i]);
  for (const std::uint32_t i : tree.around(box, leaf.members.size() + kAround))
    if (i < leaf.begin || i >= leaf.end) leaf.members.push_back(i);

  MatrixXd system = rbfMatrix(cloud_, kernel_, leaf.members);
  const auto [basis, rank] = basisOf(q_, leaf.members);
  const Index rest = system.rows() - rank;
  system = basis.rightCols(rest).transpose() * system * basis.rightCols(rest);
  // The inverse is symmetric, so the rows of the leaf's own particles equal their columns.
  const MatrixXd right = basis.rightCols(rest).topRows(own).transpose();
  leaf.inverse =
      (basis.rightCols(rest) * factor(std::move(system)).solve(right)).transpose().cast<float>();
}

void RbfPreconditioner::chooseCoarse() {
  const std::size_t n = cloud_.points.size();
  const std::size_t step = std::max(kCoarseShare, (n + kMostCoarse - 1) / kMostCoarse);
  // Neighbours in the tree's order are neighbours in space, so taking every step-th particle gives
  // an even subset.
  for (std::size_t i = step / 2; i < n; i += step) coarse_.push_back(static_cast<std::uint32_t>(i));
}

void RbfPreconditioner::factorCoarse() {
  auto [basis, rank] = basisOf(q_, coarse_);
  const Index rest = basis.cols() - rank;
  coarseQ_ = basis.rightCols(rest);
  const MatrixXd half = rbfMatrix(cloud_, kernel_, coarse_) * coarseQ_;
  coarseFactors_ = factor(coarseQ_.transpose() * half);
}

RbfColumns RbfPreconditioner::solveLeaves(const RbfColumns& residual) const {
  RbfColumns weights(residual.rows(), 3);
  tbb::parallel_for(std::size_t{0}, leaves_.size(), [&](std::size_t n) {
    const Leaf& leaf = leaves_[n];
    Eigen::MatrixX3f local(static_cast<Index>(leaf.members.size()), 3);
    for (std::size_t i = 0; i < leaf.members.size(); ++i)
      local.row(static_cast<Index>(i)) = residual.row(leaf.members[i]).cast<float>();
    weights.middleRows(leaf.begin, leaf.end - leaf.begin) = (leaf.inverse * local).cast<double>();
  });
  return weights;
}

RbfColumns RbfPreconditioner::atCoarse(const RbfColumns& weights) const {
  const std::size_t n = cloud_.points.size();
  std::vector<RbfParticle> particles(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto row = weights.row(static_cast<Index>(i));
    particles[i] = {cloud_.points[i], {row[0], row[1], row[2]}};
  }
  std::vector<std::uint32_t> all(n);
  std::iota(all.begin(), all.end(), 0u);
  const double sign = withKernel(kernel_, [](auto k) { return decltype(k)::kSign; });
  RbfColumns result(static_cast<Index>(coarse_.size()), 3);
  const std::size_t tiles = (coarse_.size() + kCoarseTile - 1) / kCoarseTile;
  tbb::parallel_for(std::size_t{0}, tiles, [&](std::size_t tile) {
    const std::size_t begin = tile * kCoarseTile;
    RbfPoints points(std::min(kCoarseTile, coarse_.size() - begin));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const V3d& p = cloud_.points[coarse_[begin + i]];
      points.x[i] = p.x, points.y[i] = p.y, points.z[i] = p.z;
    }
    addRbfSums(kernel_, particles, all, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::uint32_t at = coarse_[begin + i];
      const auto row = static_cast<Index>(begin + i);
      result.row(row) << points.u[i], points.v[i], points.w[i];
      result.row(row) = sign * result.row(row) + cloud_.lambda[at] * weights.row(at);
    }
  });
  return result;
}

RbfColumns RbfPreconditioner::operator()(const RbfColumns& residual) const {
  RbfColumns weights = solveLeaves(residual);
  weights -= q_ * (q_.transpose() * weights);
  RbfColumns rest = -atCoarse(weights);
  for (std::size_t i = 0; i < coarse_.size(); ++i)
    rest.row(static_cast<Index>(i)) += residual.row(coarse_[i]);
  const RbfColumns correction = coarseQ_ * coarseFactors_.solve(coarseQ_.transpose() * rest);
  for (std::size_t i = 0; i < coarse_.size(); ++i)
    weights.row(coarse_[i]) += correction.row(static_cast<Index>(i));
  return weights;
}

}  // namespace levelset::rbf
