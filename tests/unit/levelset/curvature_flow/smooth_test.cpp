#include "levelset/curvature_flow/smooth.h"

#include <gtest/gtest.h>
#include <openvdb/tools/Diagnostics.h>

#include <limits>

#include "levelset/csg/csg.h"
#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/grids/interpolate_vdb.h"
#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace smooth_test {

using namespace levelset;
using Imath::V3d;

const V3d kCentre(0.31, -0.17, 0.43);

NarrowBand ball(double radius) {
  return makeSphere(radius, kCentre, 1);
}

double radiusOf(const NarrowBand& band) {
  // The corners of the measured mesh lie on the surface. The original ball is measured in the same
  // way.
  return std::cbrt(3 * measure(band).volume / (4 * M_PI));
}

double shrinkage(double radius, double sigma, SmoothKind kind) {
  return radiusOf(ball(radius)) - radiusOf(smooth(ball(radius), kind, sigma));
}

/// Largest distance from a sphere over the zeros of the tricubic interpolant, on all grid edges
/// whose ends have different signs.
double worstZero(const NarrowBand& band, double radius) {
  const openvdb::FloatGrid& grid = vdb(band);
  auto accessor = grid.getConstAccessor();
  double worst = 0;
  for (auto it = grid.cbeginValueOn(); it; ++it)
    for (int axis = 0; axis < 3; ++axis) {
      openvdb::Coord next = it.getCoord();
      ++next[axis];
      if ((*it < 0) == (accessor.getValue(next) < 0)) continue;
      openvdb::Vec3d low = it.getCoord().asVec3d(), high = next.asVec3d();
      if (*it > 0) std::swap(low, high);
      for (int i = 0; i < 20; ++i) {
        const openvdb::Vec3d middle = 0.5 * (low + high);
        (SampleBlock<4>(accessor, middle).value() < 0 ? low : high) = middle;
      }
      const V3d zero = toImath(grid.indexToWorld(low));
      worst = std::max(worst, std::abs((zero - kCentre).length() - radius));
    }
  return worst;
}

// The mean of
// x
//  over a Gaussian about a point at radius r is r + σ²/r, except for the contribution of the ball's
//  other side, exp(−r²/2σ²). The smoothed ball of radius R ends where this mean is R.
TEST(Smooth, GaussianHasTheRequestedSigma) {
  constexpr double kRadius = 24;
  for (const double sigma : {0.7, 1.0, 2.0, 3.5}) {
    const double radius = (kRadius + std::sqrt(kRadius * kRadius - 4 * sigma * sigma)) / 2;
    EXPECT_LE(worstZero(smooth(ball(kRadius), SmoothKind::Gaussian, sigma), radius),
              support::measured(4.33e-4))
        << sigma;
  }
}

TEST(Smooth, MeanHasTheSameVariance) {
  for (const double sigma : {1.0, 2.0})
    EXPECT_NEAR(shrinkage(24, sigma, SmoothKind::Mean), sigma * sigma / 24,
                support::measured(0.00117))
        << sigma;
}

TEST(Smooth, TaubinKeepsTheVolume) {
  EXPECT_NEAR(shrinkage(24, 2, SmoothKind::Taubin), 0, support::rounding(0.3));
}

TEST(Smooth, GaussianRoundsAnEdgeByTheExactAmount) {
  // Near the edge φ is the maximum of two planes. The mean of max(x, y) over a Gaussian is σ/√π.
  // The surface moves inwards along the diagonal by √2 times that.
  const double sigma = 2;
  const NarrowBand box = makeBox(V3d(40, 40, 40), kCentre, 1);
  const NarrowBand rounded = smooth(box, SmoothKind::Gaussian, sigma);
  auto accessor = vdb(rounded).getConstAccessor();
  double t = 0;
  for (int i = 0; i < 20; ++i) {
    const V3d p = kCentre + V3d(20 - t, 20 - t, 0);
    t += 0.5 * SampleBlock<4>(accessor, toVdb(p)).value();
  }
  // Outside the edge φ is the distance to the edge, not the maximum of the planes, which adds a
  // little.
  EXPECT_GT(t, sigma / std::sqrt(M_PI));
  EXPECT_LT(t, 1.3 * sigma / std::sqrt(M_PI));
  EXPECT_NEAR(SampleBlock<4>(accessor, toVdb(kCentre + V3d(20, 0, 0))).value(), 0,
              support::rounding(0.8));
  EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(rounded), 6), "");
}

TEST(Smooth, MedianRemovesASpeck) {
  const NarrowBand speckled = support::sampleBand(
      [](const V3d& p) {
        return std::min((p - kCentre).length() - 10, (p - V3d(20.2, 0, 0)).length() - 0.8);
      },
      {V3d(-11), V3d(22, 11, 11)}, 1);
  EXPECT_EQ(measure(speckled).components, 2u);
  const NarrowBand cleaned = smooth(speckled, SmoothKind::Median, 2);
  EXPECT_EQ(measure(cleaned).components, 1u);
  EXPECT_NEAR(radiusOf(cleaned), 10, support::measured(0.0557));
}

/// Compares with the definition: the median of the exact distances around each grid point.
TEST(Smooth, MedianMatchesItsDefinition) {
  const double sigma = 9.3;  // extends beyond the neighbouring block
  const NarrowBand solid = makeBox(V3d(30, 22, 26), kCentre, 1);
  const NarrowBand wide = redistance(solid, {.halfWidth = sigma + 4});
  const NarrowBand smoothed = smooth(solid, SmoothKind::Median, sigma);
  auto read = vdb(wide).getConstAccessor(), result = vdb(smoothed).getConstAccessor();
  for (const openvdb::Coord c :
       {openvdb::Coord(15, 11, 0), {14, 10, 12}, {13, 9, 11}, {-13, 9, -12}, {0, 11, 13}}) {
    std::vector<float> values;
    for (int x = -9; x <= 9; ++x)
      for (int y = -9; y <= 9; ++y)
        for (int z = -9; z <= 9; ++z)
          if (x * x + y * y + z * z <= sigma * sigma)
            values.push_back(read.getValue(c.offsetBy(x, y, z)));
    std::sort(values.begin(), values.end());
    const float median = values[values.size() / 2];
    EXPECT_EQ(result.getValue(c) < 0, median < 0) << c;
  }
}

TEST(Smooth, ReportsProgressForEachBlock) {
  for (const SmoothKind kind : {SmoothKind::Median, SmoothKind::Mean, SmoothKind::Taubin}) {
    int during = 0;
    double last = 0;
    const auto count = [&](double fraction) {
      EXPECT_GE(fraction, last);
      last = fraction;
      during += fraction > 0.31 && fraction < 0.69;
      return true;
    };
    (void)smooth(ball(12), kind, 2, {.progress = count});
    EXPECT_GT(during, 20);
    const auto cancel = [](double fraction) { return fraction < 0.5; };
    EXPECT_THROW((void)smooth(ball(12), kind, 2, {.progress = cancel}), Cancelled);
  }
}

TEST(Smooth, RefusesAnEndlessMedian) {
  EXPECT_THROW((void)smooth(ball(6), SmoothKind::Median, 63), ResourceLimit);
}

/// Only grid points that a mask covers are changed. All others keep their bits.
TEST(Smooth, ChangesOnlyMaskedPoints) {
  const NarrowBand before = makeBox(V3d(40, 40, 40), kCentre, 1);
  // The full mask covers a corner up to a distance of 8.
  const V3d corner = kCentre + V3d(20);
  const Mask mask{.field = [=](const V3d& p) { return (p - corner).length(); },
                  .min = 8,
                  .max = 10,
                  .invert = true};
  for (const SmoothKind kind :
       {SmoothKind::Gaussian, SmoothKind::Mean, SmoothKind::Median, SmoothKind::Taubin}) {
    const double sigma = 1.5;
    const NarrowBand after = smooth(before, kind, sigma, {.mask = mask});
    const NarrowBand everywhere = smooth(before, kind, sigma);
    // With a second masked position at the far corner the complete box is processed. The result
    // here is the same.
    const V3d far = kCentre - V3d(20);
    const Mask both{
        .field = [=](const V3d& p) { return std::min((p - corner).length(), (p - far).length()); },
        .min = 8,
        .max = 10,
        .invert = true};
    const NarrowBand whole = smooth(before, kind, sigma, {.mask = both});
    const auto same = vdb(whole).getConstAccessor();
    for (auto it = vdb(after).cbeginValueOn(); it; ++it) {
      const V3d from = toImath(it.getCoord().asVec3d()) - corner;
      const double box = std::max({std::abs(from.x), std::abs(from.y), std::abs(from.z)});
      if (box > 20) continue;
      ASSERT_NEAR(*it, same.getValue(it.getCoord()), support::rounding(1)) << it.getCoord();
    }
    const auto old = vdb(before).getConstAccessor(), now = vdb(after).getConstAccessor(),
               all = vdb(everywhere).getConstAccessor();
    double moved = 0, off = 0;
    for (openvdb::Coord c(-30); c[0] <= 30; ++c[0])
      for (c[1] = -30; c[1] <= 30; ++c[1])
        for (c[2] = -30; c[2] <= 30; ++c[2]) {
          const V3d from = toImath(c.asVec3d()) - corner;
          const double box = std::max({std::abs(from.x), std::abs(from.y), std::abs(from.z)});
          if (box > 16) {
            ASSERT_EQ(now.getValue(c), old.getValue(c)) << c;
            ASSERT_EQ(now.isValueOn(c), old.isValueOn(c)) << c;
          }
          // Both the surface and the samples that its distance depends on are fully masked.
          if (from.length() < 3) {
            off = std::max(off, std::abs(static_cast<double>(now.getValue(c) - all.getValue(c))));
            moved =
                std::max(moved, std::abs(static_cast<double>(now.getValue(c) - old.getValue(c))));
          }
        }
    EXPECT_LE(off, support::rounding(6)) << static_cast<int>(kind);
    EXPECT_GE(moved, 0.2) << static_cast<int>(kind);
  }
}

TEST(Smooth, KeepsASolidOutsideTheMask) {
  const NarrowBand before = ball(12);
  const NarrowBand after =
      smooth(before, SmoothKind::Gaussian, 1,
             {.mask = Mask{.field = [](const V3d&) { return 0.0; }, .min = 0.5, .max = 1}});
  EXPECT_EQ(after.contentHash(), before.contentHash());
}

TEST(Smooth, RemovesAComponentInsideTheMask) {
  // A wide Gaussian removes a small ball, beside a large one outside the mask.
  const NarrowBand small = makeSphere(2.2, V3d(30, 0, 0), 1), large = makeSphere(12, V3d(0), 1);
  const NarrowBand after =
      smooth(unite(small, large), SmoothKind::Gaussian, 4,
             {.mask = Mask{.field = [](const V3d& p) { return p.x; }, .min = 20, .max = 21}});
  EXPECT_EQ(measure(after).components, 1u);
  EXPECT_NEAR(measure(after).volume, measure(large).volume,
              support::rounding(1) * measure(large).volume);
}

TEST(Smooth, KeepsTheSurfaceOutsideTheMask) {
  const Mask right{.field = [](const V3d& p) { return p.x; }, .min = 0, .max = 1};
  const NarrowBand smoothed = smooth(ball(10), SmoothKind::Gaussian, 2, {.mask = right});
  auto accessor = vdb(smoothed).getConstAccessor();
  EXPECT_NEAR(SampleBlock<4>(accessor, toVdb(kCentre - V3d(10, 0, 0))).value(), 0,
              support::measured(8.88e-5));
  EXPECT_NEAR(SampleBlock<4>(accessor, toVdb(kCentre + V3d(10, 0, 0))).value(), 0.4,
              support::measured(0.0174));
}

TEST(Smooth, DoesNotDependOnThreads) {
  std::uint64_t hashes[3];
  for (const std::size_t threads : {1, 2, 4})
    hashes[threads / 2] = support::onThreads(
        threads, [&] { return smooth(ball(10), SmoothKind::Gaussian, 1.5).contentHash(); });
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(Smooth, Refuses) {
  const NarrowBand b = ball(6);
  for (const double sigma : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW((void)smooth(b, SmoothKind::Gaussian, sigma), UsageError);
  EXPECT_THROW((void)smooth(NarrowBand(), SmoothKind::Gaussian, 1), InvalidInput);
  EXPECT_THROW((void)smooth(ball(1.5), SmoothKind::Gaussian, 4), InvalidInput);
  EXPECT_THROW((void)smooth(b, SmoothKind::Gaussian, 1, {.mask = Mask{}}), UsageError);
  EXPECT_THROW((void)smooth(b, SmoothKind::Gaussian, 1, {.maxMemory = 1000}), ResourceLimit);
  EXPECT_THROW((void)smooth(b, SmoothKind::Gaussian, 1, {.progress = [](double) { return false; }}),
               Cancelled);
}

}  // namespace smooth_test
