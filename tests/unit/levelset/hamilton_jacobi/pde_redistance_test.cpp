#include "levelset/hamilton_jacobi/pde_redistance.h"

#include <gtest/gtest.h>
#include <openvdb/tools/Diagnostics.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "levelset/error.h"
#include "levelset/inspect/compare.h"
#include "levelset/shapes/shapes.h"
#include "levelset/vdb.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace pde_redistance_test {

using namespace levelset;
using Imath::V3d;
using Shape = std::function<double(const V3d&)>;

const V3d kCentre(0.013, -0.007, 0.021);
constexpr int kResolutions[] = {10, 20, 40};

Shape sphere() {
  return [](const V3d& p) { return (p - kCentre).length() - 0.5; };
}

Shape cuboid() {
  return [](const V3d& p) {
    const V3d q(std::abs(p.x) - 0.413, std::abs(p.y) - 0.377, std::abs(p.z) - 0.291);
    const V3d out(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
    return out.length() + std::min(0.0, std::max({q.x, q.y, q.z}));
  };
}

/// Multiplies a distance by a smooth factor from 1 to 2.
Shape distorted(const Shape& shape) {
  return [=](const V3d& p) {
    return shape(p) * (1.5 + 0.5 * std::sin(6 * p.x) * std::cos(4 * p.y + 2 * p.z));
  };
}

/// Samples a field with resolution `n` so wide that no stencil reads clipped values.
NarrowBand sample(const Shape& shape, int n, double halfWidth = 14) {
  return support::sampleBand(shape, {V3d(-0.7), V3d(0.7)}, 1.0 / n, halfWidth);
}

/// Errors of the values, voxels.
struct SideErrors {
  double mean = 0, inside = 0, outside = 0;
};

SideErrors errorsOf(const NarrowBand& band, const Shape& exact) {
  SideErrors e;
  double count = 0;
  support::forEachActive(band, [&](const V3d& p, double value) {
    const double truth = exact(p), error = std::abs(value - truth) / band.voxelSize();
    double& side = truth < 0 ? e.inside : e.outside;
    side = std::max(side, error);
    e.mean += error;
    ++count;
  });
  e.mean /= count;
  return e;
}

/// Largest distance, in voxels, between the surface of a band and that of the exact shape.
double displacement(const NarrowBand& band, const Shape& exact, int n) {
  return compare(band, sample(exact, n, 3)).hausdorff() * n;
}

NarrowBand solve(const NarrowBand& field, int order, int timeOrder) {
  return pdeRedistance(field, {.halfWidth = 3, .order = order, .timeOrder = timeOrder});
}

/// Mean error, largest errors inside and outside, and displacement of the surface, voxels.
struct Expected {
  double mean, inside, outside, moved;
};

/// Solves for a distorted shape at each resolution.
void expectErrors(const Shape& shape, const std::array<Expected, 3>& all) {
  for (std::size_t i = 0; i < 3; ++i) {
    const int n = kResolutions[i];
    const NarrowBand band = solve(sample(distorted(shape), n), 5, 3);
    const SideErrors e = errorsOf(band, shape);
    EXPECT_LE(e.mean, support::measured(all[i].mean)) << n;
    EXPECT_LE(e.inside, support::measured(all[i].inside)) << n;
    EXPECT_LE(e.outside, support::measured(all[i].outside)) << n;
    EXPECT_LE(displacement(band, shape, n), support::measured(all[i].moved)) << n;
    EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(band), 6), "") << n;
  }
}

TEST(PdeRedistance, KeepsADistanceToTruncationError) {
  // Mean errors in voxels. The fronts cross a fixed number of voxels, so the error in world units
  // has one order more than the scheme. At order 5 the first-order stencils at the end of the
  // domain limit that.
  struct Scheme {
    int order, timeOrder, finest;
    double error, orderOfError;
  };
  for (const Scheme& scheme : {Scheme{1, 1, 40, 0.042, 1.93}, Scheme{2, 2, 20, 0.00501, 2.82},
                               Scheme{3, 3, 20, 9.42e-4, 3.15}, Scheme{5, 3, 40, 4.47e-6, 3.55}}) {
    double previous = 0, error = 0;
    for (const int n : kResolutions) {
      if (n > scheme.finest) continue;
      const NarrowBand band = solve(sample(sphere(), n), scheme.order, scheme.timeOrder);
      error = errorsOf(band, sphere()).mean;
      if (previous > 0) {
        EXPECT_GE(std::log2(previous / error) + 1, support::measuredOrder(scheme.orderOfError))
            << scheme.order << " at " << n;
      }
      previous = error;
    }
    EXPECT_LE(error, support::measured(scheme.error)) << scheme.order;
  }
}

TEST(PdeRedistance, RestoresADistortedSphere) {
  // The smeared sign varies within a voxel at every resolution, so the errors in voxels stay: the
  // order in world units is 1.
  expectErrors(sphere(), {{{0.00703, 0.0295, 0.057, 0.029},
                           {0.00861, 0.0353, 0.0487, 0.0297},
                           {0.00726, 0.0456, 0.0394, 0.0361}}});
}

TEST(PdeRedistance, RestoresADistortedBox) {
  // The largest errors lie outside along the edges, which the differences round.
  expectErrors(cuboid(), {{{0.147, 0.173, 0.668, 0.242},
                           {0.0799, 0.231, 0.706, 0.384},
                           {0.0464, 0.264, 0.686, 0.222}}});
}

TEST(PdeRedistance, MovesTheSurfaceMoreThanTheExactMethod) {
  const int n = 20;
  const NarrowBand field = sample(distorted(sphere()), n);
  EXPECT_LE(displacement(redistance(field, {.halfWidth = 3}), sphere(), n),
            support::measured(0.00112));
  const std::pair<int, double> moved[] = {{1, 0.104}, {2, 0.0491}, {3, 0.0426}, {5, 0.0297}};
  for (const auto& [order, voxels] : moved)
    EXPECT_LE(displacement(solve(field, order, std::min(order, 3)), sphere(), n),
              support::measured(voxels))
        << order;
}

TEST(PdeRedistance, ReadsAClippedBandAndWidensIt) {
  // The operand is clipped at three voxels, where its slopes end.
  const int n = 20;
  const NarrowBand band = pdeRedistance(sample(distorted(sphere()), n, 3), {.halfWidth = 7});
  EXPECT_NEAR(band.halfWidth(), 7, support::rounding(7));
  const SideErrors e = errorsOf(band, sphere());
  EXPECT_LE(e.mean, support::measured(0.0482));
  EXPECT_LE(e.inside, support::measured(0.182));
  EXPECT_LE(e.outside, support::measured(0.375));
  EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(band), 6), "");
  // All grid points of the band are there.
  std::size_t count = 0;
  support::forEachActive(sample(sphere(), n, 6.5), [&](const V3d& p, double) {
    count += !vdb(band).tree().isValueOn(openvdb::Coord::round(vdb(band).worldToIndex(toVdb(p))));
  });
  EXPECT_EQ(count, 0u);
}

TEST(PdeRedistance, DoesNotDependOnScale) {
  const SideErrors unit = errorsOf(solve(sample(distorted(sphere()), 10), 5, 3), sphere());
  for (const double scale : {1e-6, 1e6}) {
    const Shape ball = [=](const V3d& p) { return scale * sphere()(p / scale); };
    const Shape field = [=](const V3d& p) { return scale * distorted(sphere())(p / scale); };
    const SideErrors e = errorsOf(
        solve(support::sampleBand(field, {V3d(-0.7 * scale), V3d(0.7 * scale)}, scale / 10, 14), 5,
              3),
        ball);
    EXPECT_NEAR(e.mean, unit.mean, support::rounding(10)) << scale;
    EXPECT_NEAR(e.inside, unit.inside, support::rounding(100)) << scale;
  }
}

TEST(PdeRedistance, DoesNotDependOnThreads) {
  const NarrowBand field = sample(distorted(cuboid()), 20, 3);
  const auto hash = [&](std::size_t threads) {
    return support::onThreads(threads, [&] { return pdeRedistance(field).contentHash(); });
  };
  const std::uint64_t one = hash(1);
  EXPECT_EQ(hash(4), one);
  EXPECT_EQ(hash(7), one);
}

TEST(PdeRedistance, LeavesItsOperandAlone) {
  const NarrowBand field = sample(distorted(sphere()), 10, 3);
  const std::uint64_t before = field.contentHash();
  (void)pdeRedistance(field);
  EXPECT_EQ(field.contentHash(), before);
}

TEST(PdeRedistance, Refuses) {
  const NarrowBand ball = makeSphere(1, V3d(0), 0.2);
  for (const int order : {0, 4, 6, -1})
    EXPECT_THROW((void)pdeRedistance(ball, {.order = order}), UsageError);
  for (const int order : {0, 4, -1})
    EXPECT_THROW((void)pdeRedistance(ball, {.timeOrder = order}), UsageError);
  for (const double width : {0.5, -1.0, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW((void)pdeRedistance(ball, {.halfWidth = width}), UsageError);
  EXPECT_THROW((void)pdeRedistance(makeBand(emptyLevelSet(uniformTransform(1), 3))), InvalidInput);
  EXPECT_THROW((void)pdeRedistance(ball, {.maxMemory = 1000}), ResourceLimit);
  EXPECT_THROW((void)pdeRedistance(ball, {.progress = [](double) { return false; }}), Cancelled);
}

}  // namespace pde_redistance_test
