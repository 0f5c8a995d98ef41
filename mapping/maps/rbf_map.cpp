#include "mapping/maps/rbf_map.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/error.h"
#include "mapping/maps/rbf_block.h"

namespace mapping {
namespace {

using Imath::V3d;
using levelset::InvalidInput;

constexpr const char* kRbfMap = "rbf map";
// Two particles nearer than this share of the cloud's size give rows that rounding cannot tell
// apart.
constexpr double kSmallestGap = 1e-9;
// A cloud flatter than this share of its size leaves the gradient across it undetermined.
constexpr double kFlattest = 1e-6;

bool isFinite(const V3d& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

void checkArguments(std::span<const V3d> points, std::span<const V3d> targets,
                    std::span<const char> near, const RbfMapOptions& options) {
  for (const double lambda : {options.lambdaNear, options.lambdaFar}) {
    if (!(lambda >= 0) || !std::isfinite(lambda)) {
      throw levelset::UsageError(
          fmt::format("{}: λ is {}; give a relaxation of at least 0, in mean particle spacings",
                      kRbfMap, lambda));
    }
  }
  if (points.size() != targets.size() || points.size() != near.size()) {
    throw InvalidInput(fmt::format("{}: {} points, {} targets and {} flags; give as many of each",
                                   kRbfMap, points.size(), targets.size(), near.size()));
  }
  if (points.size() < 4) {
    throw InvalidInput(fmt::format(
        "{}: there are {} particles, and a map of space needs at least 4", kRbfMap, points.size()));
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!isFinite(points[i]) || !isFinite(targets[i])) {
      throw InvalidInput(
          fmt::format("{}: particle {} at ({}, {}, {}) is not finite; check the patch", kRbfMap, i,
                      points[i].x, points[i].y, points[i].z));
    }
  }
}

/// Distance of each point to its nearest neighbour.
std::vector<double> nearestDistances(std::span<const V3d> points) {
  std::vector<double> nearest(points.size());
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
    double best = std::numeric_limits<double>::max();
    for (std::size_t j = 0; j < points.size(); ++j)
      if (j != i) best = std::min(best, (points[i] - points[j]).length2());
    nearest[i] = std::sqrt(best);
  });
  return nearest;
}

}  // namespace

RbfMap::RbfMap(std::span<const V3d> points, std::span<const V3d> targets,
               std::span<const char> near, const RbfMapOptions& options)
    : count_(points.size()) {
  checkArguments(points, targets, near, options);
  const double n = static_cast<double>(count_);
  levelset::requireMemory(2.5 * n * n * sizeof(double), options.maxMemory, kRbfMap);

  for (const V3d& p : points) origin_ += p;
  origin_ /= n;
  double extent = 0;
  for (const V3d& p : points) extent = std::max(extent, (p - origin_).length());
  const std::vector<double> nearest = nearestDistances(points);
  double spacing = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    spacing += nearest[i];
    if (!(nearest[i] > kSmallestGap * extent)) {
      throw InvalidInput(
          fmt::format("{}: two particles share the place ({}, {}, {}); take a larger "
                      "patch or a wider spacing",
                      kRbfMap, points[i].x, points[i].y, points[i].z));
    }
  }
  meanSpacing_ = spacing / n;
  levelset::report(options.progress, 0.1, kRbfMap);

  std::vector<double> lambda(count_);
  for (std::size_t i = 0; i < count_; ++i)
    lambda[i] = meanSpacing_ * (near[i] ? options.lambdaNear : options.lambdaFar);
  solve(points, targets, lambda);
  levelset::report(options.progress, 0.9, kRbfMap);
  measureResidual(points, targets);
  levelset::report(options.progress, 1, kRbfMap);
}

/// −(φ − λ) is positive definite on the vectors that are orthogonal to constants, so the saddle
/// system is solved there: with P = Q [R; 0] for the polynomial part, ω = −Q₂ (Q₂ᵀ (λ − φ) Q₂)⁻¹
/// Q₂ᵀ f.
void RbfMap::solve(std::span<const V3d> points, std::span<const V3d> targets,
                   std::span<const double> lambda) {
  const Eigen::Index n = static_cast<Eigen::Index>(count_);
  double scale = 0;
  for (const V3d& p : points) scale = std::max(scale, (p - origin_).length());

  Eigen::MatrixXd positions(n, 3), polynomial(n, 4), values(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    const V3d p = (points[static_cast<std::size_t>(i)] - origin_) / scale;
    const V3d& t = targets[static_cast<std::size_t>(i)];
    positions.row(i) << p.x, p.y, p.z;
    polynomial.row(i) << 1, p.x, p.y, p.z;
    values.row(i) << t.x, t.y, t.z;
  }
  const Eigen::Matrix3d spread = positions.transpose() * positions / static_cast<double>(n);
  const Eigen::Vector3d axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvalues();
  if (!(axes[0] > kFlattest * kFlattest * axes[2])) {
    throw InvalidInput(
        fmt::format("{}: the {} particles about ({}, {}, {}) lie in one plane; give the "
                    "patch a height and two directions",
                    kRbfMap, count_, origin_.x, origin_.y, origin_.z));
  }

  Eigen::MatrixXd kernel(n, n);
  tbb::parallel_for(Eigen::Index{0}, n, [&](Eigen::Index j) {
    for (Eigen::Index i = 0; i < n; ++i)
      kernel(i, j) = -(positions.row(i) - positions.row(j)).norm();
    kernel(j, j) += lambda[static_cast<std::size_t>(j)] / scale;
  });
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(polynomial);
  const auto q = qr.householderQ();
  Eigen::MatrixXd rotated = values;
  rotated.applyOnTheLeft(q.transpose());
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(n, 3);
  if (n > 4) {
    Eigen::MatrixXd projected = kernel;
    projected.applyOnTheLeft(q.transpose());
    projected.applyOnTheRight(q);
    const Eigen::LLT<Eigen::MatrixXd> llt(projected.bottomRightCorner(n - 4, n - 4));
    if (llt.info() != Eigen::Success) {
      throw InvalidInput(
          fmt::format("{}: the system of {} particles cannot be solved, particles are "
                      "too close together; take a wider spacing or a larger λ",
                      kRbfMap, count_));
    }
    weights.bottomRows(n - 4) = llt.solve(rotated.bottomRows(n - 4));
    weights.applyOnTheLeft(q);
  }
  // With ω = −weights the kernel part is kernel * weights; what is left is the polynomial's.
  Eigen::MatrixXd rest = values - kernel * weights;
  rest.applyOnTheLeft(q.transpose());
  const Eigen::MatrixXd coefficients =
      qr.matrixQR().topRows(4).triangularView<Eigen::Upper>().solve(rest.topRows(4));
  if (!weights.allFinite() || !coefficients.allFinite()) {
    throw InvalidInput(
        fmt::format("{}: solving for {} particles overflowed; check the patch for "
                    "particles that lie on top of each other",
                    kRbfMap, count_));
  }

  constant_ = V3d(coefficients(0, 0), coefficients(0, 1), coefficients(0, 2));
  for (int k = 0; k < 3; ++k)
    for (int axis = 0; axis < 3; ++axis) linear_[k][axis] = coefficients(axis + 1, k) / scale;
  for (Eigen::Index i = 0; i < n; ++i) {
    const V3d weight = V3d(-weights(i, 0), -weights(i, 1), -weights(i, 2)) / scale;
    particles_.push_back({points[static_cast<std::size_t>(i)] - origin_, weight});
    weightNorm_.push_back(weight.length());
  }
}

V3d RbfMap::affine(const V3d& local) const {
  V3d result = constant_;
  for (int k = 0; k < 3; ++k)
    for (int axis = 0; axis < 3; ++axis) result[k] += linear_[k][axis] * local[axis];
  return result;
}

V3d RbfMap::operator()(const V3d& x) const {
  const V3d local = x - origin_;
  V3d sum = affine(local);
  for (const RbfParticle& particle : particles_)
    sum += particle.weight * (local - particle.position).length();
  return sum;
}

Imath::M33d RbfMap::jacobian(const V3d& x) const {
  const V3d local = x - origin_;
  Imath::M33d result = linear_;
  for (const RbfParticle& particle : particles_) {
    const V3d way = local - particle.position;
    const double distance = way.length();
    if (distance == 0) continue;
    const V3d direction = way / distance;
    for (int k = 0; k < 3; ++k)
      for (int axis = 0; axis < 3; ++axis) result[k][axis] += particle.weight[k] * direction[axis];
  }
  return result;
}

std::unique_ptr<BlockMap> RbfMap::restrictTo(const GridBlock& block, double tolerance) const {
  return std::make_unique<RbfBlock>(*this, block, tolerance);
}

void RbfMap::measureResidual(std::span<const V3d> points, std::span<const V3d> targets) {
  std::vector<V3d> residual(count_);
  tbb::parallel_for(std::size_t{0}, count_,
                    [&](std::size_t i) { residual[i] = (*this)(points[i]) - targets[i]; });
  for (const V3d& r : residual) {
    maxResidual_ = std::max(maxResidual_, r.length());
    for (int axis = 0; axis < 3; ++axis)
      axisResidual_[axis] = std::max(axisResidual_[axis], std::abs(r[axis]));
  }
}

}  // namespace mapping
