#include "levelset/rbf/rbf_solve.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "levelset/error.h"
#include "levelset/rbf/rbf_krylov.h"
#include "levelset/rbf/rbf_ridge.h"
#include "levelset/rbf/rbf_sparse.h"
#include "levelset/rbf/sums/rbf_sum.h"

namespace levelset::rbf {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Imath::V3d;

/// Eigen divides products of matrices into blocks by the sizes of the caches. Fixed sizes give the
/// same bits on all processors.
[[maybe_unused]] const bool kHasFixedBlocks = [] {
  Eigen::setCpuCacheSizes(48 << 10, 2 << 20, 32 << 20);
  return true;
}();

// Systems of at most this many particles are always solved directly.
constexpr std::size_t kAlwaysDense = 500;
constexpr std::size_t kChunk = 512;

double signOf(RbfKernel kernel) {
  return withKernel(kernel, [](auto k) { return decltype(k)::kSign; });
}

/// Values at the particles of the linear polynomials that the particles can distinguish: 1, and the
/// coordinates along the axes in which the cloud has a width.
MatrixXd polynomialOf(const RbfCloud& cloud) {
  const auto n = static_cast<Index>(cloud.points.size());
  MatrixXd result(n, 1 + cloud.directions);
  for (Index i = 0; i < n; ++i) {
    result(i, 0) = 1;
    for (int d = 0; d < cloud.directions; ++d)
      result(i, d + 1) =
          cloud.points[static_cast<std::size_t>(i)].dot(cloud.axes[static_cast<std::size_t>(d)]) /
          cloud.extent;
  }
  return result;
}

/// Rotates the unit vector u by the least rotation that maps the unit vector a to b.
/// @pre u ⟂ a
V3d turned(const V3d& u, const V3d& a, const V3d& b, bool isFirst) {
  const double cosine = a.dot(b);
  // The least rotation is not unique. Takes half a turn about the first of the two axes
  // perpendicular to a, so that axis is kept (`isFirst`) and the second one is reversed.
  if (cosine < -1 + 1e-12) return isFirst ? u : -u;
  return u - (a + b) * (u.dot(b) / (1 + cosine));
}

/// Gradient of the map in the directions that the particles do not span. Normal to a plane, it is
/// the normal of the plane's image times the mean scale in the plane, with the same handedness.
/// Around a line, it continues the rotation and scale of the line.
Imath::M33d missingGradient(const RbfCloud& cloud, const MatrixXd& coefficients) {
  Imath::M33d result(0, 0, 0, 0, 0, 0, 0, 0, 0);
  const auto along = [&](int d) {
    return V3d(coefficients(d + 1, 0), coefficients(d + 1, 1), coefficients(d + 1, 2)) /
           cloud.extent;
  };
  const auto add = [&](const V3d& axis, const V3d& image) {
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 3; ++i) result[k][i] += image[k] * axis[i];
  };
  if (cloud.directions == 2) {
    const V3d normal = along(0).cross(along(1));
    const double area = normal.length();
    if (area > 0) add(cloud.axes[0].cross(cloud.axes[1]), normal / std::sqrt(area));
  } else if (cloud.directions == 1) {
    const V3d image = along(0);
    const double scale = image.length();
    if (scale > 0) {
      for (const int d : {1, 2}) {
        const V3d& axis = cloud.axes[static_cast<std::size_t>(d)];
        add(axis, turned(axis, cloud.axes[0], image / scale, d == 1) * scale);
      }
    }
  }
  return result;
}

void addGradient(const RbfCloud& cloud, const Imath::M33d& gradient, double factor,
                 RbfColumns& values) {
  for (Index i = 0; i < values.rows(); ++i)
    for (int k = 0; k < 3; ++k)
      for (int axis = 0; axis < 3; ++axis)
        values(i, k) +=
            factor * gradient[k][axis] * cloud.points[static_cast<std::size_t>(i)][axis];
}

/// Solves by Cholesky factors, which overwrite the lower triangle of `system`; the upper triangle
/// is kept. If the matrix is not positive definite within rounding errors, its diagonal is
/// increased.
MatrixXd solveDefinite(Eigen::Ref<MatrixXd> system, const MatrixXd& right, RbfSolveReport& report) {
  const Eigen::VectorXd diagonal = system.diagonal();
  const double norm = system.cwiseAbs().colwise().sum().maxCoeff();
  std::optional<Eigen::LLT<Eigen::Ref<MatrixXd>>> factors;
  raiseUntilDefinite(report, [&](double ridge) {
    if (ridge > 0) {
      system.triangularView<Eigen::StrictlyLower>() =
          system.transpose().triangularView<Eigen::StrictlyLower>();
      system.diagonal() = diagonal.array() + ridge * norm;
    }
    factors.emplace(system);
    return factors->info() == Eigen::Success ? factors->rcond() : 0;
  });
  return factors->solve(right);
}

/// Computes weights orthogonal to the linear polynomials by Cholesky factorisation.
RbfColumns solveDirectly(const RbfCloud& cloud, RbfKernel kernel,
                         const Eigen::HouseholderQR<MatrixXd>& polynomial, const RbfColumns& values,
                         const Progress& progress, RbfSolveReport& report) {
  const Index n = values.rows(), rank = polynomial.matrixQR().cols();
  RbfColumns weights = RbfColumns::Zero(n, 3);
  if (n == rank) return weights;
  std::vector<std::uint32_t> all(cloud.points.size());
  std::iota(all.begin(), all.end(), 0u);
  MatrixXd system = rbfMatrix(cloud, kernel, all);
  levelset::report(progress, 0.1);
  const auto q = polynomial.householderQ();
  system.applyOnTheLeft(q.transpose());
  system.applyOnTheRight(q);
  RbfColumns rotated = values;
  rotated.applyOnTheLeft(q.transpose());
  weights.bottomRows(n - rank) = solveDefinite(system.bottomRightCorner(n - rank, n - rank),
                                               rotated.bottomRows(n - rank), report);
  weights.applyOnTheLeft(q);
  return weights;
}

}  // namespace

MatrixXd rbfMatrix(const RbfCloud& cloud, RbfKernel kernel, std::span<const std::uint32_t> chosen) {
  const auto n = static_cast<Index>(chosen.size());
  MatrixXd result(n, n);
  withKernel(kernel, [&](auto k) {
    using Kernel = decltype(k);
    tbb::parallel_for(Index{0}, n, [&](Index j) {
      const std::uint32_t at = chosen[static_cast<std::size_t>(j)];
      for (Index i = 0; i < n; ++i)
        result(i, j) =
            Kernel::kSign *
            Kernel::value(
                (cloud.points[chosen[static_cast<std::size_t>(i)]] - cloud.points[at]).length());
      result(j, j) += cloud.lambda[at];
    });
  });
  return result;
}

RbfColumns multiplyDirectly(const RbfCloud& cloud, RbfKernel kernel, const RbfColumns& weights) {
  const std::size_t n = cloud.points.size();
  std::vector<RbfParticle> particles(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto row = weights.row(static_cast<Index>(i));
    particles[i] = {cloud.points[i], {row[0], row[1], row[2]}};
  }
  std::vector<std::uint32_t> all(n);
  std::iota(all.begin(), all.end(), 0u);
  RbfColumns result(static_cast<Index>(n), 3);
  const double sign = signOf(kernel);
  tbb::parallel_for(std::size_t{0}, (n + kChunk - 1) / kChunk, [&](std::size_t chunk) {
    const std::size_t begin = chunk * kChunk, count = std::min(kChunk, n - begin);
    RbfPoints points(count);
    for (std::size_t i = 0; i < count; ++i) {
      const V3d& p = cloud.points[begin + i];
      points.x[i] = p.x, points.y[i] = p.y, points.z[i] = p.z;
    }
    addRbfSums(kernel, particles, all, points);
    for (std::size_t i = 0; i < count; ++i) {
      const auto row = static_cast<Index>(begin + i);
      result.row(row) << points.u[i], points.v[i], points.w[i];
      result.row(row) = sign * result.row(row) + cloud.lambda[begin + i] * weights.row(row);
    }
  });
  return result;
}

RbfSolution solveRbf(const RbfCloud& cloud, const RbfOptions& options, RbfSolveReport& report) {
  const auto n = static_cast<Index>(cloud.points.size());
  const double count = static_cast<double>(n), denseBytes = 1.25 * count * count * sizeof(double);
  const Eigen::HouseholderQR<MatrixXd> polynomial(polynomialOf(cloud));
  RbfColumns values(n, 3);
  for (Index i = 0; i < n; ++i)
    for (int k = 0; k < 3; ++k) values(i, k) = cloud.targets[static_cast<std::size_t>(i)][k];

  const Imath::M33d missing = missingGradient(cloud, polynomial.solve(values));
  addGradient(cloud, missing, -1, values);
  const bool isSparse = isCompact(options.kernel);
  report.isIterative = !isSparse && cloud.points.size() > kAlwaysDense &&
                       (cloud.points.size() > options.denseLimit ||
                        denseBytes > static_cast<double>(options.maxMemory));
  RbfFit fit;
  if (isSparse) {
    fit = solveSparsely(cloud, options, polynomialOf(cloud), values, report);
  } else if (report.isIterative) {
    const MatrixXd q = polynomial.householderQ() * MatrixXd::Identity(n, 1 + cloud.directions);
    fit = solveIteratively(cloud, options, q, values, report);
  } else {
    withContext("solving the RBF map", [&] { requireMemory(denseBytes, options.maxMemory); });
    fit.weights =
        solveDirectly(cloud, options.kernel, polynomial, values, options.progress, report);
    fit.image = multiplyDirectly(cloud, options.kernel, fit.weights);
  }
  // The linear polynomial fits the targets minus the sums of the kernels. The remainder
  // is the residual of the solution.
  RbfColumns rest = values - fit.image;
  const MatrixXd coefficients = polynomial.solve(rest);
  rest -= polynomialOf(cloud) * coefficients;
  report.solveResidual = rest.cwiseAbs().maxCoeff();
  const RbfColumns& weights = fit.weights;
  if (!weights.allFinite() || !coefficients.allFinite()) {
    throw NumericalError(
        fmt::format("solving for {} particles overflowed; check for particles that are "
                    "much closer than others",
                    cloud.points.size()));
  }

  RbfSolution solution;
  const double sign = signOf(options.kernel);
  for (Index i = 0; i < n; ++i)
    solution.weights.push_back(V3d(weights(i, 0), weights(i, 1), weights(i, 2)) * sign);
  solution.linear = missing;
  for (int k = 0; k < 3; ++k) {
    solution.constant[k] = coefficients(0, k);
    for (int d = 0; d < cloud.directions; ++d)
      for (int axis = 0; axis < 3; ++axis)
        solution.linear[k][axis] +=
            coefficients(d + 1, k) / cloud.extent * cloud.axes[static_cast<std::size_t>(d)][axis];
  }
  return solution;
}

}  // namespace levelset::rbf
