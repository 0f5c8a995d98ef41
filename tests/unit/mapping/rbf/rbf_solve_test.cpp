#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/rbf/sums/cluster_tree.h"
#include "levelset/rbf/sums/rbf_cluster_sum.h"
#include "mapping/rbf/rbf_map.h"
#include "tests/support/map_clouds.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace rbf_solve_test {

using Imath::V3d;
using mapping::RbfKernel;
using mapping::RbfMap;
using mapping::RbfMapOptions;
using mapping::RbfSolveReport;
using support::affine;
using support::bend;
using support::Cloud;
using support::fit;
using support::lattice;

const std::array kPlaces = {V3d(0.3, 0.2, 0.9), V3d(5, -4, 3), V3d(-20, 10, 7)};

class Solve : public ::testing::TestWithParam<RbfKernel> {};
INSTANTIATE_TEST_SUITE_P(All, Solve, ::testing::ValuesIn(support::kKernels),
                         ::testing::PrintToStringParamName());

bool says(const RbfSolveReport& report, const std::string& what) {
  for (const std::string& note : report.notes)
    if (note.find(what) != std::string::npos) return true;
  return false;
}

bool isSound(const RbfMap& map) {
  for (const V3d& x : kPlaces) {
    const V3d y = map(x);
    if (!std::isfinite(y.x) || !std::isfinite(y.y) || !std::isfinite(y.z)) return false;
    for (int k = 0; k < 3; ++k)
      for (int axis = 0; axis < 3; ++axis)
        if (!std::isfinite(map.jacobian(x)[k][axis])) return false;
  }
  return true;
}

/// Scales by 1.7, rotates by 3-4-5 angles and translates.
V3d similarity(const V3d& p) {
  const V3d turned(0.6 * p.x - 0.8 * p.y, 0.8 * p.x + 0.6 * p.y, p.z);
  return V3d(turned.x, 0.6 * turned.y - 0.8 * turned.z, 0.8 * turned.y + 0.6 * turned.z) * 1.7 +
         V3d(3, -1, 2);
}

TEST_P(Solve, EqualParticlesCountOnce) {
  const Cloud cloud = lattice(4, bend);
  Cloud twice = cloud;
  for (const std::size_t i : {9u, 40u, 9u}) {
    twice.points.push_back(cloud.points[i] + V3d(1e-12));
    twice.targets.push_back(cloud.targets[i]);
    twice.near.push_back(cloud.near[i]);
  }
  const RbfMap once = fit(cloud, 0.1, GetParam()), map = fit(twice, 0.1, GetParam());
  EXPECT_EQ(map.size(), 64u);
  EXPECT_EQ(map.solveReport().merged, 3u);
  EXPECT_EQ(map.solveReport().averaged, 0u);
  EXPECT_TRUE(says(map.solveReport(), "3 particles share the position and values"));
  for (const V3d& x : kPlaces) EXPECT_LT((map(x) - once(x)).length(), support::measured(1.37e-13));
}

TEST_P(Solve, ParticlesAtOnePositionAreAveraged) {
  const Cloud cloud = lattice(4, bend);
  Cloud twice = cloud, mean = cloud;
  const V3d off(0.1, -0.05, 0.02);
  twice.add(cloud.points[9], cloud.targets[9] + off);
  mean.targets[9] += off / 2;
  const RbfMap map = fit(twice, 0, GetParam()), expected = fit(mean, 0, GetParam());
  EXPECT_EQ(map.solveReport().averaged, 1u);
  EXPECT_TRUE(says(map.solveReport(), "1 particles share the position of another"));
  for (const V3d& x : kPlaces)
    EXPECT_LT((map(x) - expected(x)).length(), support::measured(5.38e-13));
  EXPECT_NEAR(map.maxResidual(), off.length() / 2, support::doubleRounding(12.5));
  // Neighbours are about 1 apart in texture coordinates too.
  twice.targets.back() += V3d(9, 0, 0);
  EXPECT_THROW((void)fit(twice, 0, GetParam()), levelset::InvalidInput);
}

TEST_P(Solve, FlatCloudsAreExtendedPerpendicularly) {
  Cloud cloud;
  for (const Cloud source = lattice(5, similarity); const V3d& p : source.points)
    if (p.z < 0.5) {
      const V3d q(p.x, p.y, 0.5 * p.x - 0.3 * p.y);  // on an inclined plane
      cloud.add(q, similarity(q));
    }
  const RbfMap map = fit(cloud, 0.1, GetParam());
  EXPECT_EQ(map.solveReport().directions, 2);
  EXPECT_TRUE(says(map.solveReport(), "in one plane"));
  for (const V3d& x : kPlaces)
    EXPECT_LT((map(x) - similarity(x)).length(), support::measured(8.53e-14));
  // A curved map of the plane is followed within the plane.
  for (std::size_t i = 0; i < cloud.points.size(); ++i) cloud.targets[i] = bend(cloud.points[i]);
  const RbfMap bent = fit(cloud, 0, GetParam());
  EXPECT_LT(bent.maxResidual(), support::doubleRounding(25));
  EXPECT_TRUE(isSound(bent));
}

TEST_P(Solve, LinesRotateAndScaleSpaceLikeTheirMap) {
  const auto scaled = [](const V3d& p) { return 2.5 * p + V3d(1, 2, 3); };
  const auto turned = [](const V3d& p) { return V3d(-p.y, p.x, p.z) * 0.5; };
  Cloud along, about;
  for (const double t : {0.0, 1.0, 2.2, 3.1, 4.5}) {
    along.add(V3d(1, 2, -1) * t, scaled(V3d(1, 2, -1) * t));
    about.add(V3d(1, 1, 0) * t, turned(V3d(1, 1, 0) * t));
  }
  const RbfMap stretch = fit(along, 0, GetParam()), turn = fit(about, 0.2, GetParam());
  EXPECT_EQ(stretch.solveReport().directions, 1);
  EXPECT_TRUE(says(stretch.solveReport(), "on one line"));
  for (const V3d& x : kPlaces) {
    EXPECT_LT((stretch(x) - scaled(x)).length(), support::measured(6.12e-14));
    EXPECT_LT((turn(x) - turned(x)).length(), support::doubleRounding(25));
  }
  // For a reversed line any half turn is correct; lengths are kept.
  Cloud back;
  for (const double t : {0.0, 1.0, 2.0}) back.add(V3d(t, 0, 0), V3d(-t, 0, 0));
  const RbfMap reversed = fit(back, 0, GetParam());
  EXPECT_NEAR((reversed(V3d(3, 4, 5)) - reversed(V3d(1, 1, 1))).length(), V3d(2, 3, 4).length(),
              support::doubleRounding(6));
  EXPECT_GT(reversed.jacobian(V3d(0.3)).determinant(), 0.99);
}

TEST_P(Solve, AFewParticlesDefineAMap) {
  Cloud cloud;
  cloud.add(V3d(1, 2, 3), V3d(0.5, 0.25, 1));
  const RbfMap one = fit(cloud, 0.2, GetParam());
  EXPECT_EQ(one.solveReport().directions, 0);
  EXPECT_TRUE(says(one.solveReport(), "constant"));
  for (const V3d& x : kPlaces)
    EXPECT_LT((one(x) - V3d(0.5, 0.25, 1)).length(), support::doubleRounding(4));
  cloud.add(V3d(1, 2, 4), V3d(0.5, 0.25, 3));
  const RbfMap two = fit(cloud, 0.2, GetParam());  // scales by 2, without rotation
  for (const V3d& x : kPlaces)
    EXPECT_LT((two(x) - (2.0 * x - V3d(1.5, 3.75, 5))).length(), support::doubleRounding(60));
  cloud.add(V3d(2, 2, 3), V3d(2.5, 0.25, 1));
  const RbfMap three = fit(cloud, 0.2, GetParam());
  for (const V3d& x : kPlaces)
    EXPECT_LT((three(x) - (2.0 * x - V3d(1.5, 3.75, 5))).length(), support::doubleRounding(25));
  cloud.add(V3d(5, 6, 7), affine(V3d(5, 6, 7)));
  EXPECT_LT(fit(cloud, 0.2, GetParam()).maxResidual(), support::doubleRounding(20));
}

// Pairs at all distances down to the smallest that is resolved, with the targets of a smooth map.
// For any condition number the map interpolates them and is finite.
TEST_P(Solve, ClusteredParticlesAreSolved) {
  for (const double gap : {1e-2, 1e-4, 1e-6, 1e-7, 2e-8}) {
    Cloud cloud = lattice(5, bend);
    for (const std::size_t i : {12u, 62u, 100u})
      for (const V3d& way : {V3d(gap, 0, 0), V3d(0, gap, gap)}) {
        const V3d p = cloud.points[i] + way;
        cloud.add(p, bend(p));
      }
    const RbfMap map = fit(cloud, 0, GetParam());
    EXPECT_EQ(map.size(), 131u) << gap;
    EXPECT_LT(map.maxResidual(), support::measured(8.93e-9)) << gap;
    EXPECT_TRUE(isSound(map)) << gap;
    EXPECT_LT((map(V3d(2.4)) - bend(V3d(2.4))).length(), support::measured(0.0306)) << gap;
    EXPECT_EQ(map.solveReport().isRegularized, says(map.solveReport(), "added to its diagonal"));
    const RbfMap relaxed = fit(cloud, 0.25, GetParam());
    EXPECT_LT(relaxed.maxResidual(), support::measured(0.0414)) << gap;
    EXPECT_FALSE(relaxed.solveReport().isRegularized) << gap;
  }
}

/// A curved slab of particles, like that of a patch.
Cloud slab(int side) {
  Cloud cloud;
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i) {
        const V3d t = V3d(i, j, 0) / (side - 1) + V3d(0, 0, k / 4.0);
        const double angle = 2.1 * t.x + 0.02 * std::sin(7 * t.y), r = 2 + 0.6 * t.z;
        cloud.add(
            V3d(r * std::sin(angle), 4.2 * t.y + 0.05 * std::sin(9 * t.x), r * std::cos(angle)), t,
            k == 0);
      }
  return cloud;
}

TEST_P(Solve, IterationAgreesWithFactorization) {
  const Cloud cloud = slab(14);
  const V3d centre(1.6, 2.1, 1.3);
  for (const auto& [lambda, tolerance] : {std::pair(0.0, 1e-4), std::pair(0.25, 1e-8)}) {
    const RbfMap dense = fit(cloud, lambda, GetParam());
    const RbfMap map =
        fit(cloud, lambda, {.kernel = GetParam(), .denseLimit = 600, .solveTolerance = tolerance});
    const RbfSolveReport& report = map.solveReport();
    // The sparse matrix of a compact kernel is always factored.
    EXPECT_EQ(report.isIterative, !levelset::rbf::isCompact(GetParam()));
    EXPECT_FALSE(dense.solveReport().isIterative);
    if (report.isIterative) {
      EXPECT_GT(report.iterations, 2u);
      EXPECT_LT(report.iterations, 120u);
    }
    EXPECT_LE(report.solveResidual, tolerance);
    EXPECT_GT(report.condition, 1);
    for (int i = 0; i < 50; ++i) {
      const V3d x = centre + V3d(std::sin(i), std::sin(3 * i), std::sin(7 * i)) * 0.6;
      EXPECT_LT((map(x) - dense(x)).length(), support::measured(0.176) * tolerance) << lambda;
    }
  }
}

TEST(IterativeSolve, SameBitsForAnyNumberOfThreads) {
  const Cloud cloud = slab(16);
  const auto solve = [&] { return fit(cloud, 0.1, {.denseLimit = 600}); };
  const RbfMap one = support::onThreads(1, solve), many = support::onThreads(7, solve);
  EXPECT_TRUE(many.solveReport().isIterative);
  EXPECT_EQ(one.solveReport().iterations, many.solveReport().iterations);
  for (const V3d& x : kPlaces) EXPECT_EQ(one(x), many(x));
}

TEST(IterativeSolve, ReplacesFactorizationWhenMemoryIsLimited) {
  const Cloud cloud = slab(24);
  const RbfMap map = fit(cloud, 0.1, {.maxMemory = 20'000'000});
  EXPECT_EQ(map.size(), 2880u);
  EXPECT_TRUE(map.solveReport().isIterative);
  const RbfMap dense = fit(cloud, 0.1);
  EXPECT_FALSE(dense.solveReport().isIterative);
  EXPECT_GT(dense.solveReport().condition, 1e3);
  for (const V3d& x : kPlaces) EXPECT_LT((map(x) - dense(x)).length(), support::rounding(5));
  EXPECT_THROW((void)fit(cloud, 0.1, {.maxMemory = 1'000'000}), levelset::ResourceLimit);
}

TEST(IterativeSolve, RefusesWithoutConvergence) {
  EXPECT_THROW((void)fit(slab(12), 0.1, {.denseLimit = 600, .solveTolerance = 1e-30}),
               levelset::NumericalError);
}

TEST(ClusterSum, ApproximatesTheDirectSum) {
  const Cloud cloud = slab(30);
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  const levelset::rbf::ClusterTree tree(cloud.points, 128);
  std::vector<V3d> points, weights;
  for (const std::uint32_t i : tree.order()) {
    points.push_back(cloud.points[i]);
    weights.emplace_back(normal(random), normal(random), normal(random));
  }
  const levelset::rbf::RbfClusterSum fast(RbfKernel::Biharmonic, points, tree.nodes());
  const std::vector<V3d> sums = fast(weights);
  double worst = 0, largest = 0;
  for (std::size_t i = 0; i < points.size(); i += 13) {
    V3d direct(0);
    for (std::size_t j = 0; j < points.size(); ++j)
      direct += weights[j] * (points[i] - points[j]).length();
    worst = std::max(worst, (sums[i] - direct).length());
    largest = std::max(largest, direct.length());
  }
  EXPECT_LT(worst, support::rounding(4) * largest);
}

TEST(ClusterTree, FindsNeighbours) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<V3d> points;
  for (int i = 0; i < 700; ++i) points.emplace_back(unit(random), unit(random) / 9, i % 3);
  for (int i = 0; i < 40; ++i) points.push_back(points[5]);
  const levelset::rbf::ClusterTree tree(points, 7);
  const Imath::Box3d box(V3d(0.2, 0, 0), V3d(0.5, 0.1, 0.2));
  for (std::uint32_t i = 0; i < points.size(); i += 11) {
    std::pair best(HUGE_VAL, i);
    std::size_t within = 0;
    for (std::uint32_t j = 0; j < points.size(); ++j) {
      const double squared = (points[j] - points[i]).length2();
      if (j != i) best = std::min(best, std::pair(squared, j));
      if (squared <= 0.01) ++within;
    }
    EXPECT_EQ(tree.nearest(i), best.second);
    EXPECT_EQ(tree.within(points[i], 0.1).size(), within);
  }
  std::vector<std::pair<double, std::uint32_t>> all;
  for (std::uint32_t j = 0; j < points.size(); ++j)
    all.emplace_back(levelset::rbf::squaredGap(Imath::Box3d(points[j], points[j]), box), j);
  std::sort(all.begin(), all.end());
  const std::vector<std::uint32_t> around = tree.around(box, 300);
  ASSERT_EQ(around.size(), 300u);
  for (std::size_t n = 0; n < around.size(); ++n) EXPECT_EQ(around[n], all[n].second);
  EXPECT_EQ(tree.around(box, 10000).size(), points.size());
}

}  // namespace rbf_solve_test
