#include "levelset/rbf/rbf_function.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "levelset/error.h"
#include "levelset/rbf/rbf_solve.h"

namespace levelset::rbf {
namespace {

using Imath::V3d;

constexpr std::size_t kResidualChunk = 512;

void checkTolerance(double tolerance) {
  if (!(tolerance > 0) || !std::isfinite(tolerance)) {
    throw UsageError(
        fmt::format("the solver tolerance is {}; give a positive share of the extent of the values",
                    tolerance));
  }
}

}  // namespace

RbfFunction::RbfFunction(std::span<const V3d> points, std::span<const V3d> targets,
                         std::span<const char> near, const RbfOptions& options)
    : kernel_(options.kernel) {
  checkTolerance(options.solveTolerance);
  const RbfCloud cloud = makeRbfCloud(points, targets, near, options, solveReport_);
  origin_ = cloud.origin;
  spacing_ = cloud.spacing;
  unit_ = cloud.unit;
  levelset::report(options.progress, 0.05);
  const RbfSolution solution = solveRbf(cloud, options, solveReport_);
  constant_ = solution.constant;
  linear_ = solution.linear;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    particles_.push_back({cloud.points[i], solution.weights[i]});
    weightNorms_.push_back(solution.weights[i].length());
  }
  levelset::report(options.progress, 0.9);
  measureResidual(points, targets);
  levelset::report(options.progress, 1);
}

V3d RbfFunction::affine(const V3d& local) const {
  V3d result = constant_;
  for (int k = 0; k < 3; ++k)
    for (int axis = 0; axis < 3; ++axis) result[k] += linear_[k][axis] * local[axis];
  return result;
}

V3d RbfFunction::operator()(const V3d& x) const {
  const V3d local = (x - origin_) / unit_;
  V3d sum = affine(local);
  withKernel(kernel_, [&](auto kernel) {
    for (const RbfParticle& particle : particles_)
      sum += particle.weight * decltype(kernel)::value((local - particle.position).length());
  });
  return sum;
}

Imath::M33d RbfFunction::jacobian(const V3d& x) const {
  const V3d local = (x - origin_) / unit_;
  Imath::M33d result = linear_;
  withKernel(kernel_, [&](auto kernel) {
    for (const RbfParticle& particle : particles_) {
      const V3d offset = local - particle.position;
      const double distance = offset.length();
      if (distance == 0) continue;
      const V3d slope = offset * (decltype(kernel)::slope(distance) / distance);
      for (int k = 0; k < 3; ++k)
        for (int axis = 0; axis < 3; ++axis) result[k][axis] += particle.weight[k] * slope[axis];
    }
  });
  return result * (1 / unit_);
}

std::vector<V3d> RbfFunction::valuesAt(std::span<const V3d> points) const {
  std::vector<V3d> result(points.size());
  std::vector<std::uint32_t> all(particles_.size());
  std::iota(all.begin(), all.end(), 0u);
  const std::size_t chunks = (points.size() + kResidualChunk - 1) / kResidualChunk;
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t chunk) {
    const std::size_t begin = chunk * kResidualChunk;
    RbfPoints sums(std::min(kResidualChunk, points.size() - begin));
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const V3d local = (points[begin + i] - origin_) / unit_, value = affine(local);
      sums.x[i] = local.x, sums.y[i] = local.y, sums.z[i] = local.z;
      sums.u[i] = value.x, sums.v[i] = value.y, sums.w[i] = value.z;
    }
    addRbfSums(kernel_, particles_, all, sums);
    for (std::size_t i = 0; i < sums.size(); ++i)
      result[begin + i] = V3d(sums.u[i], sums.v[i], sums.w[i]);
  });
  return result;
}

void RbfFunction::measureResidual(std::span<const V3d> points, std::span<const V3d> targets) {
  const std::vector<V3d> values = valuesAt(points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const V3d r = values[i] - targets[i];
    maxResidual_ = std::max(maxResidual_, r.length());
    for (int axis = 0; axis < 3; ++axis)
      axisResidual_[axis] = std::max(axisResidual_[axis], std::abs(r[axis]));
  }
}

}  // namespace levelset::rbf
