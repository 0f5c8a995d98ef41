#include "mapping/rbf/rbf_map.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "levelset/error.h"
#include "mapping/rbf/rbf_block.h"
#include "tests/support/map_clouds.h"
#include "tests/support/measured.h"

namespace rbf_map_test {

using Imath::M33d;
using Imath::V3d;
using mapping::GridBlock;
using mapping::RbfMap;
using mapping::RbfMapOptions;

using mapping::RbfKernel;
using support::affine;
using support::bend;
using support::Cloud;
using support::fit;
using support::lattice;

class KernelMap : public ::testing::TestWithParam<RbfKernel> {};
INSTANTIATE_TEST_SUITE_P(All, KernelMap, ::testing::ValuesIn(support::kKernels),
                         ::testing::PrintToStringParamName());

TEST_P(KernelMap, IsExactAtParticlesWithoutRelaxation) {
  const Cloud cloud = lattice(6, bend);
  const RbfMap map = fit(cloud, 0, GetParam());
  EXPECT_EQ(map.size(), 216u);
  EXPECT_LT(map.maxResidual(), support::doubleRounding(100));
  for (std::size_t i = 0; i < cloud.points.size(); i += 17)
    EXPECT_LT((map(cloud.points[i]) - cloud.targets[i]).length(), support::measured(1.48e-14));
  const mapping::RbfSolveReport& report = map.solveReport();
  EXPECT_GT(report.condition, 1);
  EXPECT_LT(report.condition, 1e9);
  EXPECT_FALSE(report.isRegularized || report.isIterative);
  EXPECT_TRUE(report.notes.empty());
}

TEST_P(KernelMap, ReproducesAffineMapsForAnyRelaxation) {
  const V3d shift(1e4, -2e4, 3e4);
  for (const double lambda : {0.0, 0.25, 0.5, 100.0}) {
    const Cloud cloud = lattice(5, affine, shift);
    const RbfMap map = fit(cloud, lambda, GetParam());
    for (const V3d& x : {V3d(2.2, 1.7, 3.1), V3d(-4, 9, 2), V3d(40, -30, 20)})
      EXPECT_LT((map(x + shift) - affine(x)).length(), support::measured(7.75e-11)) << lambda;
    EXPECT_LT(map.maxResidual(), support::measured(1.36e-12));
  }
}

/// Largest error, away from the sides, of the map through edge³ particles of the unit cube.
double quadraticError(int edge, RbfKernel kernel) {
  const auto quadratic = [](const V3d& p) {
    return V3d(p.x * p.x - 0.5 * p.y * p.z, p.y + p.z * p.z, p.z - p.x * p.y);
  };
  Cloud cloud;
  for (int i = 0; i < edge * edge * edge; ++i) {
    const V3d p = V3d(i / (edge * edge), i / edge % edge, i % edge) / (edge - 1);
    cloud.add(p, quadratic(p));
  }
  const RbfMap map = fit(cloud, 0, kernel);
  double worst = 0;
  for (int i = 0; i < 1000; ++i) {
    const V3d x(0.3 + 0.4 * (i / 100) / 9, 0.3 + 0.4 * (i / 10 % 10) / 9, 0.3 + 0.4 * (i % 10) / 9);
    worst = std::max(worst, (map(x) - quadratic(x)).length());
  }
  return worst;
}

// Polynomials of degree one are reproduced for any kernel. The error of a quadratic map falls like
// h² if the kernel scales with the spacing. Growing kernels depend on all particles.
TEST_P(KernelMap, ConvergesWithTheStatedOrder) {
  const bool isLocal = GetParam() == RbfKernel::Laplacian || GetParam() == RbfKernel::Gaussian ||
                       GetParam() == RbfKernel::Wendland;
  const double coarse = quadraticError(5, GetParam()), middle = quadraticError(8, GetParam()),
               fine = quadraticError(11, GetParam());
  EXPECT_GT(std::log(coarse / fine) / std::log(10 / 4.0), isLocal ? 1.9 : 4.0);
  EXPECT_LT(middle, coarse);
  EXPECT_LT(fine, middle);
  EXPECT_LT(fine, isLocal ? 6e-3 : 3.1e-5);
}

TEST_P(KernelMap, ResidualGrowsWithRelaxation) {
  const Cloud cloud = lattice(6, bend);
  double last = -1;
  for (const double lambda : {0.0, 0.05, 0.25, 0.5}) {
    const double residual = fit(cloud, lambda, GetParam()).maxResidual();
    EXPECT_GT(residual, last);
    last = residual;
  }
  EXPECT_LT(last, support::measured(0.0931));
}

// Numerical evidence for the erratum: φ(r) = r needs φ − λ, the others need φ + λ. The wrong sign
// amplifies noise.
TEST_P(KernelMap, RelaxationRemovesNoise) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.1);
  Cloud cloud;
  for (int i = 0; i < 125; ++i) {
    const V3d p(i / 25, i / 5 % 5, i % 5);
    cloud.add(p, 0.2 * p + V3d(noise(random), noise(random), noise(random)));
  }
  const auto error = [&](double lambda) {
    const RbfMap map = fit(cloud, lambda, GetParam());
    double sum = 0;
    for (int i = 0; i < 125; ++i) {  // between the particles, where no noise is given
      const V3d p(i / 25 * 0.8 + 0.4, i / 5 % 5 * 0.8 + 0.4, i % 5 * 0.8 + 0.4);
      sum += (map(p) - 0.2 * p).length2() / 3;
    }
    return std::sqrt(sum / 125);
  };
  EXPECT_LT(error(0.5), support::measured(0.828, 0.85) * error(0));
  EXPECT_LT(error(0.5), error(0.1));
}

TEST_P(KernelMap, JacobianIsTheDerivative) {
  const Cloud cloud = lattice(5, bend);
  const RbfMap map = fit(cloud, 0.1, GetParam());
  const double step = 1e-5;
  for (const V3d& x : {V3d(1.63, 2.41, 2.87), V3d(9, -7, 3), cloud.points[62] + V3d(0.01)}) {
    const M33d jacobian = map.jacobian(x);
    for (int axis = 0; axis < 3; ++axis) {
      V3d ahead = x, behind = x;
      ahead[axis] += step;
      behind[axis] -= step;
      const V3d slope = (map(ahead) - map(behind)) / (2 * step);
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(jacobian[k][axis], slope[k], support::measured(1.52e-9));
    }
  }
  // All kernels except r are smooth at particles. The kink of r contributes zero there.
  const V3d p = cloud.points[62];
  for (int k = 0; k < 3; ++k) {
    const V3d around = (map(p + V3d(0, step, 0)) - map(p - V3d(0, step, 0))) / (2 * step);
    EXPECT_NEAR(map.jacobian(p)[k][1], around[k], support::measured(2.1e-10));
  }
}

TEST_P(KernelMap, DoesNotDependOnUnitPositionAndRotation) {
  const Cloud cloud = lattice(5, bend);
  const RbfMap map = fit(cloud, 0.2, GetParam());
  for (const double unit : {1e-6, 3.0, 2e5}) {
    const V3d shift = V3d(30, -70, 20) * unit;
    const auto moved = [&](const V3d& p) { return V3d(-p.y, p.x, p.z) * unit + shift; };
    Cloud other = cloud;
    for (V3d& p : other.points) p = moved(p);
    const RbfMap image = fit(other, 0.2, GetParam());
    EXPECT_NEAR(image.meanSpacing(), map.meanSpacing() * unit, support::doubleRounding(8) * unit);
    for (const V3d& x : {V3d(2.2, 1.7, 3.1), V3d(-4, 9, 2), V3d(0, 4, 1)})
      EXPECT_LT((image(moved(x)) - map(x)).length(), support::measured(1.02e-13)) << unit;
  }
}

/// Block of a grid that is rotated and slightly sheared.
GridBlock blockAt(const V3d& origin, double step, int edge) {
  GridBlock block{origin, M33d(), edge};
  for (int i = 0; i < 3; ++i) block.rows[i][i] = step;
  block.rows[0][1] = 0.15 * step;
  return block;
}

TEST_P(KernelMap, BoundsContainTheImage) {
  const RbfMap map = fit(lattice(5, bend), 0, GetParam());
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const double size : {0.2, 1.4, 5.0, 40.0})
    for (const int edge : {8, 16, 64})
      for (const V3d& origin : {V3d(1.9, 2.2, 2.6), V3d(-9, 3, 0.5)}) {
        const GridBlock block = blockAt(origin, size / (edge - 1), edge);
        const Imath::Box3d box = map.restrictTo(block, 1e-4)->imageBounds();
        for (int i = 0; i < 200; ++i) {
          const V3d t = V3d(unit(random), unit(random), unit(random)) * (edge - 1);
          const V3d x = origin + block.row(0) * t.x + block.row(1) * t.y + block.row(2) * t.z;
          EXPECT_TRUE(box.intersects(map(x))) << size << " " << edge;
        }
        // A valid bound must also be tight, or it excludes nothing.
        // The peaks of the Laplacian are as wide as the smallest block.
        if (size < 0.5) {
          EXPECT_LT(box.size().x, (GetParam() == RbfKernel::Laplacian ? 2 : 1.6) * size);
        }
      }
}

/// Largest difference between the map at points and in its leaf blocks.
double leafError(const RbfMap& map, const GridBlock& block, const mapping::BlockMap& at,
                 std::size_t& near) {
  double worst = 0;
  if (block.edge > GridBlock::kLeafEdge) {
    for (int bits = 0; bits < 8; ++bits)
      worst = std::max(worst, leafError(map, block.octant(bits), *at.octant(bits), near));
    return worst;
  }
  near += dynamic_cast<const mapping::RbfBlock&>(at).nearCount();
  std::array<V3d, 512> values;
  at.evaluate(values);
  for (std::size_t n = 0; n < 512; ++n) {
    const V3d x = block.origin + block.row(0) * static_cast<double>(n / 64) +
                  block.row(1) * static_cast<double>(n / 8 % 8) +
                  block.row(2) * static_cast<double>(n % 8);
    worst = std::max(worst, (values[n] - map(x)).length());
  }
  return worst;
}

TEST_P(KernelMap, BlocksAgreeWithPoints) {
  const Cloud cloud = lattice(9, bend);
  const RbfMap map = fit(cloud, 0, GetParam());
  for (const int edge : {8, GetParam() == RbfKernel::Biharmonic ? 32 : 16})
    for (const V3d& origin : {cloud.points[400], V3d(-2, 4, 9), V3d(7.9, 0.1, 4)}) {
      const GridBlock block = blockAt(origin, 0.13, edge);
      const double leaves = std::pow(edge / 8, 3);
      for (const double tolerance : {1e-3, 1e-6, 0.0}) {
        std::size_t near = 0;
        const double error = leafError(map, block, *map.restrictTo(block, tolerance), near);
        EXPECT_LE(error, tolerance + 1e-12) << edge;
        // A larger tolerance leaves fewer particles to single grid points.
        if (tolerance == 0) {
          EXPECT_EQ(near, map.size() * static_cast<std::size_t>(leaves));
        }
        if (tolerance == 1e-3) {
          EXPECT_LT(static_cast<double>(near), 0.4 * leaves * 729) << edge;
        }
      }
    }
}

TEST(RbfMap, RefusesInvalidParticles) {
  EXPECT_THROW((void)fit({}, 0), levelset::InvalidInput);
  Cloud nan = lattice(3, affine);
  nan.points[4].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)fit(nan, 0), levelset::InvalidInput);
  Cloud infinite = lattice(3, affine);
  infinite.targets[4].y = std::numeric_limits<double>::infinity();
  EXPECT_THROW((void)fit(infinite, 0), levelset::InvalidInput);
  Cloud wide = lattice(3, affine);
  wide.points[0].x = -1.7e308, wide.points[1].x = 1.7e308;
  EXPECT_THROW((void)fit(wide, 0), levelset::InvalidInput);
  const Cloud sound = lattice(3, affine);
  EXPECT_THROW((void)fit(sound, -0.1), levelset::UsageError);
  EXPECT_THROW((void)fit(sound, std::numeric_limits<double>::infinity()), levelset::UsageError);
  EXPECT_THROW((void)fit(sound, std::numeric_limits<double>::quiet_NaN()), levelset::UsageError);
  EXPECT_THROW((void)fit(sound, 0, {.solveTolerance = 0}), levelset::UsageError);
  EXPECT_THROW((void)fit(sound, 0, {.maxMemory = 1000}), levelset::ResourceLimit);
  EXPECT_THROW((void)fit(sound, 0, {.progress = [](double) { return false; }}),
               levelset::Cancelled);
}

}  // namespace rbf_map_test
