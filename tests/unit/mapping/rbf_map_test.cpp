#include "mapping/maps/rbf_map.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "levelset/error.h"
#include "mapping/maps/rbf_block.h"

namespace rbf_map_test {

using Imath::M33d;
using Imath::V3d;
using mapping::GridBlock;
using mapping::RbfMap;
using mapping::RbfMapOptions;

struct Cloud {
  std::vector<V3d> points, targets;
  std::vector<char> near;
};

V3d bend(const V3d& p) {
  return {p.x + 0.05 * p.y * p.y, p.y + 0.1 * std::sin(p.z), p.z - 0.04 * p.x * p.y};
}
V3d affine(const V3d& p) {
  return {0.3 * p.x - 0.1 * p.y + 7, 0.2 * p.y + 0.4 * p.z - 3, 0.5 * p.z + 0.1 * p.x};
}

/// A slightly jittered lattice of spacing 1, moved far from the origin by `shift`.
template <typename Map>
Cloud lattice(int edge, const Map& map, const V3d& shift = V3d(0)) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> jitter(-0.2, 0.2);
  Cloud cloud;
  for (int i = 0; i < edge; ++i)
    for (int j = 0; j < edge; ++j)
      for (int k = 0; k < edge; ++k) {
        const V3d p(i + jitter(random), j + jitter(random), k + jitter(random));
        cloud.points.push_back(p + shift);
        cloud.targets.push_back(map(p));
        cloud.near.push_back(k == 0);
      }
  return cloud;
}

RbfMap fit(const Cloud& cloud, double lambda) {
  return {cloud.points, cloud.targets, cloud.near, {.lambdaNear = lambda, .lambdaFar = lambda}};
}

TEST(RbfMap, IsExactAtParticlesWithoutRelaxation) {
  const Cloud cloud = lattice(6, bend);
  const RbfMap map = fit(cloud, 0);
  EXPECT_EQ(map.size(), 216u);
  EXPECT_LT(map.maxResidual(), 1e-11);
  for (std::size_t i = 0; i < cloud.points.size(); i += 17)
    EXPECT_LT((map(cloud.points[i]) - cloud.targets[i]).length(), 1e-11);
  // Between the particles of a smooth map it is near, too.
  EXPECT_LT((map(V3d(2.5)) - bend(V3d(2.5))).length(), 0.02);
}

TEST(RbfMap, ReproducesAffineMapsWhateverTheRelaxation) {
  const V3d shift(1e4, -2e4, 3e4);
  for (const double lambda : {0.0, 0.25, 0.5}) {
    const Cloud cloud = lattice(5, affine, shift);
    const RbfMap map = fit(cloud, lambda);
    for (const V3d& x : {V3d(2.2, 1.7, 3.1), V3d(-4, 9, 2), V3d(40, -30, 20)})
      EXPECT_LT((map(x + shift) - affine(x)).length(), 1e-8);
    EXPECT_LT(map.maxResidual(), 1e-9);
  }
}

TEST(RbfMap, ResidualGrowsWithRelaxation) {
  const Cloud cloud = lattice(6, bend);
  double last = -1;
  for (const double lambda : {0.0, 0.05, 0.25, 0.5}) {
    const double residual = fit(cloud, lambda).maxResidual();
    EXPECT_GT(residual, last);
    last = residual;
  }
  EXPECT_LT(last, 0.2);
}

// The experiment behind the erratum: φ(r) = r needs φ − λ; with φ + λ noise would grow.
TEST(RbfMap, RelaxationRemovesNoise) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.1);
  Cloud cloud;
  std::vector<V3d> truth;
  for (int i = 0; i < 125; ++i) {
    const V3d p(i / 25, i / 5 % 5, i % 5);
    truth.push_back(0.2 * p);
    cloud.points.push_back(p);
    cloud.targets.push_back(0.2 * p + V3d(noise(random), noise(random), noise(random)));
    cloud.near.push_back(0);
  }
  const auto error = [&](double lambda) {
    const RbfMap map = fit(cloud, lambda);
    double sum = 0;
    for (int i = 0; i < 125; ++i) {  // between the particles, where noise is not given
      const V3d p(i / 25 * 0.8 + 0.4, i / 5 % 5 * 0.8 + 0.4, i % 5 * 0.8 + 0.4);
      sum += (map(p) - 0.2 * p).length2() / 3;
    }
    return std::sqrt(sum / 125);
  };
  EXPECT_LT(error(0.5), 0.85 * error(0));
  EXPECT_LT(error(0.5), error(0.1));
}

TEST(RbfMap, JacobianIsTheSlope) {
  const RbfMap map = fit(lattice(5, bend), 0.1);
  const V3d x(1.63, 2.41, 2.87);
  const M33d jacobian = map.jacobian(x);
  const double step = 1e-5;
  for (int axis = 0; axis < 3; ++axis) {
    V3d ahead = x, behind = x;
    ahead[axis] += step;
    behind[axis] -= step;
    const V3d slope = (map(ahead) - map(behind)) / (2 * step);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(jacobian[k][axis], slope[k], 1e-7);
  }
}

/// A block of a grid that is turned and sheared a little.
GridBlock blockAt(const V3d& origin, double step, int edge) {
  GridBlock block{origin, M33d(), edge};
  for (int i = 0; i < 3; ++i) block.rows[i][i] = step;
  block.rows[0][1] = 0.15 * step;
  return block;
}

TEST(RbfMap, BoundsHoldTheImage) {
  const RbfMap map = fit(lattice(5, bend), 0);
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
        // A bound that holds is not enough: it has to be near, or it excludes nothing.
        if (size < 0.5) {
          EXPECT_LT(box.size().x, 1.6 * size);
        }
      }
}

/// Largest difference between the map's points and its leaf blocks.
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

TEST(RbfMap, BlocksAgreeWithPoints) {
  const RbfMap map = fit(lattice(9, bend), 0);
  for (const int edge : {8, 16, 32})
    for (const V3d& origin : {V3d(3.1, 3.3, 2.9), V3d(-2, 4, 9), V3d(7.9, 0.1, 4)}) {
      const GridBlock block = blockAt(origin, 0.13, edge);
      const double leaves = std::pow(edge / 8, 3);
      for (const double tolerance : {1e-3, 1e-6, 0.0}) {
        std::size_t near = 0;
        const double error = leafError(map, block, *map.restrictTo(block, tolerance), near);
        EXPECT_LE(error, tolerance + 1e-12) << edge;
        // The more may be off, the fewer particles are left to the grid points.
        if (tolerance == 0) {
          EXPECT_EQ(near, map.size() * static_cast<std::size_t>(leaves));
        }
        if (tolerance == 1e-3) {
          EXPECT_LT(static_cast<double>(near), 0.4 * leaves * 729) << edge;
        }
      }
    }
}

TEST(RbfMap, RefusesCloudsThatSpanNoSpace) {
  Cloud flat = lattice(5, affine);
  for (V3d& p : flat.points) p.z = 2;
  EXPECT_THROW((void)fit(flat, 0.1), levelset::InvalidInput);
  Cloud line = lattice(3, affine);
  for (V3d& p : line.points) p.y = p.z = 0;
  EXPECT_THROW((void)fit(line, 0), levelset::InvalidInput);
  Cloud twice = lattice(4, affine);
  twice.points[9] = twice.points[40];
  EXPECT_THROW((void)fit(twice, 0), levelset::InvalidInput);
  Cloud few = lattice(2, affine);
  few.points.resize(3), few.targets.resize(3), few.near.resize(3);
  EXPECT_THROW((void)fit(few, 0), levelset::InvalidInput);
  Cloud nan = lattice(3, affine);
  nan.points[4].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)fit(nan, 0), levelset::InvalidInput);
  const Cloud sound = lattice(3, affine);
  EXPECT_THROW((void)fit(sound, -0.1), levelset::UsageError);
  EXPECT_THROW((void)fit(sound, std::numeric_limits<double>::infinity()), levelset::UsageError);
  EXPECT_THROW((void)RbfMap(sound.points, sound.targets, sound.near, {.maxMemory = 1000}),
               levelset::ResourceLimit);
  EXPECT_THROW((void)RbfMap(sound.points, sound.targets, sound.near,
                            {.progress = [](double) { return false; }}),
               levelset::Cancelled);
}

TEST(RbfMap, FourParticlesGiveTheAffineMap) {
  const std::vector<V3d> points = {V3d(0), V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)};
  std::vector<V3d> targets;
  for (const V3d& p : points) targets.push_back(affine(p));
  const std::vector<char> near(4, 1);
  EXPECT_LT((RbfMap(points, targets, near)(V3d(3, 4, 5)) - affine(V3d(3, 4, 5))).length(), 1e-12);
}

}  // namespace rbf_map_test
