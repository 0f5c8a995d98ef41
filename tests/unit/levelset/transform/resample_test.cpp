#include "levelset/transform/resample.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"
#include "levelset/vdb.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace resample_test {

using namespace levelset;
using Imath::V3d;

double sphere(const V3d& p) {
  return p.length() - 1;
}

struct BandError {
  /// Largest errors, voxels: within one voxel of the surface, and anywhere.
  double surface = 0, band = 0;
};

template <typename Phi>
BandError errorOf(const NarrowBand& band, const Phi& phi) {
  BandError error;
  support::forEachActive(band, [&](const V3d& p, double value) {
    const double off = std::abs(value - phi(p)) / band.voxelSize();
    error.band = std::max(error.band, off);
    if (std::abs(value) < band.voxelSize()) error.surface = std::max(error.surface, off);
  });
  return error;
}

/// Expects that tree and background are those of a sphere of radius one, with a filled inside.
void expectUnitSphere(const NarrowBand& band, double voxelSize, double halfWidth) {
  EXPECT_NEAR(band.voxelSize(), voxelSize, support::doubleRounding(1));
  EXPECT_NEAR(band.halfWidth(), halfWidth, support::rounding(6));
  const double count = 4 * M_PI / (voxelSize * voxelSize) * 2 * halfWidth;
  EXPECT_NEAR(static_cast<double>(band.activeVoxelCount()), count,
              support::measured(0.0662) * count);
  for (double x = -1.45; x < 1.5; x += 0.1)
    for (double y = -1.45; y < 1.5; y += 0.1) {
      const V3d p(x, y, 0.05);
      const auto c = openvdb::Coord::round(vdb(band).worldToIndex(toVdb(p)));
      const V3d at = toImath(vdb(band).indexToWorld(c));
      if (std::abs(sphere(at)) > 0.1 * voxelSize) {
        EXPECT_EQ(vdb(band).tree().getValue(c) < 0, sphere(at) < 0) << c;
      }
    }
}

TEST(Resample, KeepsASphereAtAnyVoxelSize) {
  const double h = 1.0 / 24;
  const NarrowBand source = makeSphere(1, V3d(0), h);
  for (const double factor : {1.0, 0.9, 0.5, 0.3, 1.3, 2.0, 4.0}) {
    const NarrowBand result = resample(source, factor * h);
    expectUnitSphere(result, factor * h, 3);
    const BandError error = errorOf(result, sphere);
    // In voxels of the source, or of the result if those are larger.
    EXPECT_LT(error.surface * std::min(factor, 1.0), support::measured(0.00127))
        << "factor " << factor;
    EXPECT_LT(error.band * std::min(factor, 1.0), support::measured(0.00127))
        << "factor " << factor;
  }
}

TEST(Resample, RotatedAndMovedGridHoldsTheSameSolid) {
  const double h = 1.0 / 24;
  const NarrowBand source = makeSphere(1, V3d(0), h, {.halfWidth = 4});
  const Imath::M44d placement = Imath::M44d().setScale(0.8 * h) *
                                Imath::M44d().setEulerAngles(V3d(0.4, 0.5, 0.6)) *
                                Imath::M44d().setTranslation(V3d(3, -2, 0.1));
  const NarrowBand result = resampleTo(source, placement);
  expectUnitSphere(result, 0.8 * h, 4);
  EXPECT_LT(errorOf(result, sphere).surface, support::measured(1.25e-4));
  const NarrowBand back = resampleLike(result, source);
  expectUnitSphere(back, h, 4);
  EXPECT_LT(errorOf(back, sphere).surface, support::measured(8.34e-5));
}

TEST(Resample, ConvergesInSecondOrderAtLeast) {
  double previous = 0;
  for (const int resolution : {12, 24, 48}) {
    const NarrowBand source = makeSphere(1, V3d(0.01, 0.02, 0.03), 1.0 / resolution);
    const NarrowBand result = resample(source, 0.7 / resolution);
    const auto phi = [](const V3d& p) { return (p - V3d(0.01, 0.02, 0.03)).length() - 1; };
    const double error = errorOf(result, phi).surface * result.voxelSize();
    if (previous > 0) {
      EXPECT_GT(std::log2(previous / error), support::measuredOrder(2.89));
    }
    previous = error;
  }
}

TEST(Resample, WidensAndNarrowsTheBand) {
  const NarrowBand source = makeSphere(1, V3d(0), 0.05);
  for (const double halfWidth : {1.0, 2.0, 6.0}) {
    const NarrowBand result = resample(source, 0.05, {.halfWidth = halfWidth});
    expectUnitSphere(result, 0.05, halfWidth);
    EXPECT_LT(errorOf(result, sphere).band, support::measured(0.00268));
  }
  // A band of one voxel holds too few samples and is widened first.
  const NarrowBand thin = makeSphere(1, V3d(0), 0.05, {.halfWidth = 1});
  expectUnitSphere(resample(thin, 0.04, {.halfWidth = 3}), 0.04, 3);
}

TEST(Resample, OwnGridIsTheSameSolid) {
  const NarrowBand source = makeSphere(1, V3d(0), 0.1);
  EXPECT_EQ(resampleLike(source, makeBox(V3d(1), V3d(0), 0.1)).contentHash(), source.contentHash());
}

// A cubic through samples on both sides of an edge overshoots, by a quarter of a new voxel.
TEST(Resample, KeepsFacesFlatUpToTheirEdges) {
  const NarrowBand box = makeBox(V3d(20, 20, 6), V3d(0), 0.5);
  const Imath::Box3d bounds = measure(resample(box, 0.25)).bounds;
  const V3d half(10, 10, 3);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(bounds.max[axis], half[axis], support::rounding(1) * 0.25);
    EXPECT_NEAR(bounds.min[axis], -half[axis], support::rounding(1) * 0.25);
  }
}

TEST(Resample, SameBitsForAnyNumberOfThreads) {
  const NarrowBand source = makeTorus(10, 4, V3d(0.3), V3d(1, 1, 0), 0.5);
  std::vector<std::uint64_t> hashes;
  for (const std::size_t threads : {1, 2, 4})
    hashes.push_back(
        support::onThreads(threads, [&] { return resample(source, 0.3).contentHash(); }));
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(Resample, RefusesInvalidArguments) {
  const NarrowBand source = makeSphere(1, V3d(0.5), 0.1);
  for (const double bad : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW((void)resample(source, bad), UsageError);
    EXPECT_THROW((void)resample(source, 0.1, {.halfWidth = bad}), UsageError);
  }
  EXPECT_THROW((void)resample(makeSphere(0.2, V3d(0.5), 0.05), 1), InvalidInput)
      << "the result is empty";
  EXPECT_THROW((void)resample(NarrowBand(), 0.1), InvalidInput);
  EXPECT_THROW((void)resampleTo(source, Imath::M44d().setScale(V3d(1, 1, 2))), InvalidInput);
  EXPECT_THROW((void)resampleTo(source, Imath::M44d().setScale(V3d(1, 1, -1))), InvalidInput);
  EXPECT_THROW((void)resample(source, 0.01, {.maxMemory = 1'000'000}), ResourceLimit);
  EXPECT_THROW((void)resample(source, 1e-9, {.maxMemory = 1'000'000'000}), ResourceLimit);
  EXPECT_THROW((void)resample(source, 0.1, {.progress = [](double) { return false; }}), Cancelled);
}

}  // namespace resample_test
