#include "levelset/rbf/rbf_sparse.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "levelset/error.h"
#include "mapping/rbf/rbf_map.h"
#include "tests/support/map_clouds.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

// Compact kernels. KernelMap, Solve and Kernel test them beside the other kernels.
namespace rbf_sparse_test {

using Imath::V3d;
using mapping::RbfKernel;
using mapping::RbfMap;
using mapping::RbfMapOptions;
using support::bend;
using support::Cloud;
using support::fit;
using support::lattice;

RbfMapOptions compact(double support) {
  return {.kernel = RbfKernel::Wendland, .support = support};
}

levelset::rbf::RbfCloud cloudOf(const Cloud& cloud, RbfMapOptions options) {
  mapping::RbfSolveReport report;
  options.lambdaNear = options.lambdaFar = 0;
  return makeRbfCloud(cloud.points, cloud.targets, cloud.near, options, report);
}

/// Unit cube with edge³ particles that sample a smooth map.
V3d wave(const V3d& p) {
  return {p.x + 0.1 * std::sin(3 * p.y), p.y + 0.1 * std::cos(3 * p.z), p.z + 0.1 * p.x * p.y};
}
Cloud cube(int edge) {
  Cloud cloud;
  for (int i = 0; i < edge * edge * edge; ++i) {
    const V3d p = V3d(i / (edge * edge), i / edge % edge, i % edge) / (edge - 1);
    cloud.add(p, wave(p));
  }
  return cloud;
}

/// Largest error of a map of cube() away from its sides.
double waveError(const RbfMap& map) {
  double worst = 0;
  for (int i = 0; i < 1000; ++i) {
    const V3d x = V3d(0.3) + V3d(i / 100, i / 10 % 10, i % 10) * (0.4 / 9);
    worst = std::max(worst, (map(x) - wave(x)).length());
  }
  return worst;
}

TEST(CompactKernel, SparseMatrixHasTheEntriesOfTheDenseOne) {
  const Cloud cloud = lattice(6, bend);
  for (const double support : {1.5, 3.0, 20.0}) {
    const RbfMapOptions options = compact(support);
    const levelset::rbf::RbfCloud at = cloudOf(cloud, options);
    std::vector<std::uint32_t> all(at.points.size());
    for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
    const Eigen::MatrixXd dense = levelset::rbf::rbfMatrix(at, options.kernel, all);
    const auto lower = levelset::rbf::sparseRbfMatrix(at, options);
    EXPECT_EQ(Eigen::MatrixXd(Eigen::MatrixXd(lower).selfadjointView<Eigen::Lower>()), dense)
        << support;
    // Beyond the support radius nothing is stored.
    const auto pairs = static_cast<Eigen::Index>(216 * 217 / 2);
    EXPECT_EQ(lower.nonZeros() == pairs, support == 20) << support;
  }
}

TEST(CompactKernel, MatrixIsPositiveDefiniteForAnySupport) {
  const Cloud cloud = lattice(5, bend);
  std::vector<std::uint32_t> all(cloud.points.size());
  for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  double last = 2;
  for (const double support : {1.2, 2.0, 4.0, 8.0}) {
    const Eigen::MatrixXd matrix =
        levelset::rbf::rbfMatrix(cloudOf(cloud, compact(support)), RbfKernel::Wendland, all);
    const double least =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix).eigenvalues().minCoeff();
    EXPECT_GT(least, 0) << support;
    EXPECT_LT(least, last);
    // The least eigenvalue of this kernel decreases as the cube of the spacing in support radii.
    if (support == 8.0) {
      EXPECT_GT(least / last, 1 / support::measured(7.72));
    }
    last = least;
  }
}

// The estimate from a few solutions is a lower bound, and close.
TEST(CompactKernel, ReportsItsCondition) {
  const Cloud cloud = lattice(6, bend);
  std::vector<std::uint32_t> all(cloud.points.size());
  for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  for (const double support : {1.5, 4.0, 10.0}) {
    const Eigen::MatrixXd matrix =
        levelset::rbf::rbfMatrix(cloudOf(cloud, compact(support)), RbfKernel::Wendland, all);
    const double truth = matrix.cwiseAbs().colwise().sum().maxCoeff() *
                         matrix.inverse().cwiseAbs().colwise().sum().maxCoeff();
    const double condition = fit(cloud, 0, compact(support)).solveReport().condition;
    EXPECT_LE(condition, truth * (1 + 1e-9)) << support;
    EXPECT_GE(condition, 0.5 * truth) << support;
  }
}

TEST(CompactKernel, InterpolatesForAnySupport) {
  const Cloud cloud = lattice(6, bend);
  for (const double support : {1.01, 1.5, 3.0, 6.0, 12.0, 40.0}) {
    const RbfMap map = fit(cloud, 0, compact(support));
    EXPECT_LT(map.maxResidual(), support::doubleRounding(250)) << support;
    EXPECT_NEAR(map.function().unit(), support * map.meanSpacing(),
                support::doubleRounding(4) * support);
    EXPECT_FALSE(map.solveReport().isIterative || map.solveReport().isRegularized);
  }
}

// A support of constant width in space converges as a smooth kernel does. One that shrinks with the
// spacing is of second order, see KernelMap.
TEST(CompactKernel, ConvergesFastWithAFixedSupport) {
  const auto errorWith = [](int edge) {
    return waveError(fit(cube(edge), 0, compact(0.6 * (edge - 1))));
  };
  const double coarse = errorWith(4), middle = errorWith(6), fine = errorWith(9);
  EXPECT_LT(middle, coarse);
  EXPECT_LT(fine, middle);
  EXPECT_GT(std::log(coarse / fine) / std::log(8 / 3.0), support::measuredOrder(3.26));
}

TEST(CompactKernel, LargerSupportHasASmallerError) {
  const Cloud cloud = cube(9);
  double last = HUGE_VAL;
  for (const double support : {1.5, 2.5, 4.0, 6.0}) {
    const double error = waveError(fit(cloud, 0, compact(support)));
    EXPECT_LT(error, last) << support;
    last = error;
  }
  EXPECT_LT(last, support::measured(2.61e-4));
}

// Blocks leave out the particles whose support ends before them.
TEST(CompactKernel, DistantParticlesAddNothing) {
  const Cloud cloud = lattice(7, bend);
  const RbfMap map = fit(cloud, 0, compact(1.8));
  const V3d x(2.2, 1.7, 3.1), far(400, -300, 100);
  EXPECT_EQ(map.jacobian(far), map.function().linearPart() * (1 / map.function().unit()));
  Imath::M33d rows;
  for (int i = 0; i < 3; ++i) rows[i][i] = 0.02;
  std::array<V3d, 512> uvw;
  const std::size_t operations =
      map.restrictTo({x, rows, mapping::GridBlock::kLeafEdge}, 1e-9)->evaluate(uvw);
  EXPECT_LT(operations, 512u * 60);
  EXPECT_GT(operations, 512u * 10);
  EXPECT_LT((uvw[0] - map(x)).length(), support::doubleRounding(40));
}

TEST(CompactKernel, RefusesInvalidSupportAndSmallMemory) {
  const Cloud cloud = lattice(6, bend);
  for (const double support : {1.0, 0.5, 0.0, -3.0, std::numeric_limits<double>::infinity(),
                               std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW((void)fit(cloud, 0, compact(support)), levelset::UsageError) << support;
  // Other kernels have no support radius.
  EXPECT_NO_THROW((void)fit(cloud, 0, {.support = 0}));
  RbfMapOptions small = compact(4);
  small.maxMemory = 10'000;  // less than the matrix
  EXPECT_THROW((void)fit(cloud, 0, small), levelset::ResourceLimit);
  small.maxMemory = 500'000;  // less than the factors
  EXPECT_THROW((void)fit(cloud, 0, small), levelset::ResourceLimit);
  small.maxMemory = 5'000'000;
  EXPECT_NO_THROW((void)fit(cloud, 0, small));
}

TEST(CompactKernel, SameBitsForAnyNumberOfThreads) {
  const Cloud cloud = lattice(8, bend);
  const auto solve = [&] { return fit(cloud, 0.1, compact(3)); };
  const RbfMap one = support::onThreads(1, solve), many = support::onThreads(7, solve);
  for (const V3d& x : {V3d(0.3, 0.2, 0.9), V3d(3, 4, 3), V3d(-20, 10, 7)})
    EXPECT_EQ(one(x), many(x));
}

}  // namespace rbf_sparse_test
