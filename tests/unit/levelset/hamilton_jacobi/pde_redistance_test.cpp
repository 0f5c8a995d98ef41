#include "levelset/hamilton_jacobi/pde_redistance.h"

#include <gtest/gtest.h>
#include <openvdb/tools/Diagnostics.h>

#include <cmath>
#include <functional>
#include <limits>

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
constexpr int kResolutions[] = {8, 16, 32};

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

TEST(PdeRedistance, KeepsADistanceToTruncationError) {
  // Mean errors in voxels. The fronts cross a fixed number of voxels, so the error in world units
  // has one order more than the scheme.
  struct Scheme {
    int order, timeOrder;
    double error, orderOfError;
  };
  for (const Scheme& scheme : {Scheme{1, 1, 0.042, 1.93}, Scheme{2, 2, 0.00132, 2.82},
                               Scheme{3, 3, 1.54e-4, 3.16}, Scheme{5, 3, 1.34e-6, 4.4}}) {
    double previous = 0, error = 0;
    for (const int n : kResolutions) {
      const NarrowBand band = solve(sample(sphere(), n), scheme.order, scheme.timeOrder);
      error = errorsOf(band, sphere()).mean;
      if (previous > 0) {
        std::printf("scheme %d order %.3g\n", scheme.order, std::log2(previous / error) + 1);
        EXPECT_GE(std::log2(previous / error) + 1, support::measuredOrder(scheme.orderOfError))
            << scheme.order << " at " << n;
      }
      previous = error;
    }
    std::printf("scheme %d error %.3g\n", scheme.order, error);
    EXPECT_LE(error, support::measured(scheme.error)) << scheme.order;
  }
}

TEST(PdeRedistance, RestoresADistortedSphere) {
  struct Expected {
    double mean, inside, outside, moved;
  };
  const Expected all[] = {{1, 1, 1, 1}, {1, 1, 1, 1}, {1, 1, 1, 1}};
  for (int i = 0; i < 3; ++i) {
    const int n = kResolutions[i];
    const NarrowBand band = solve(sample(distorted(sphere()), n), 5, 3);
    const SideErrors e = errorsOf(band, sphere());
    std::printf("sphere %d: %.3g %.3g %.3g moved %.3g\n", n, e.mean, e.inside, e.outside,
                displacement(band, sphere(), n));
    EXPECT_LE(e.mean, support::measured(all[i].mean)) << n;
    EXPECT_LE(e.inside, support::measured(all[i].inside)) << n;
    EXPECT_LE(e.outside, support::measured(all[i].outside)) << n;
    EXPECT_LE(displacement(band, sphere(), n), support::measured(all[i].moved)) << n;
    EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(band), 6), "");
  }
}

TEST(PdeRedistance, RestoresADistortedBox) {
  for (int i = 0; i < 3; ++i) {
    const int n = kResolutions[i];
    const NarrowBand band = solve(sample(distorted(cuboid()), n), 5, 3);
    const SideErrors e = errorsOf(band, cuboid());
    std::printf("box %d: %.3g %.3g %.3g moved %.3g\n", n, e.mean, e.inside, e.outside,
                displacement(band, cuboid(), n));
  }
}

TEST(PdeRedistance, MovesTheSurfaceMoreThanTheExactMethod) {
  const int n = 16;
  const NarrowBand field = sample(distorted(sphere()), n);
  const double exact = displacement(redistance(field, {.halfWidth = 3}), sphere(), n);
  std::printf("exact moved %.3g\n", exact);
  for (const int order : {1, 2, 3, 5})
    std::printf("order %d moved %.3g\n", order,
                displacement(solve(field, order, std::min(order, 3)), sphere(), n));
}

TEST(PdeRedistance, ReadsAClippedBandAndWidensIt) {
  // The operand is clipped at three voxels, where its slopes end.
  const int n = 16;
  const NarrowBand band = pdeRedistance(sample(distorted(sphere()), n, 3), {.halfWidth = 7});
  EXPECT_NEAR(band.halfWidth(), 7, support::rounding(7));
  const SideErrors e = errorsOf(band, sphere());
  std::printf("clipped: %.3g %.3g %.3g\n", e.mean, e.inside, e.outside);
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
