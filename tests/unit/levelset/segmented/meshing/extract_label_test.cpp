// Regions of segmented fields as solids.

#include "levelset/segmented/meshing/extract_label.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "levelset/error.h"
#include "levelset/inspect/check.h"
#include "levelset/segmented/segment_solids.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace extract_label_test {

using namespace levelset;
using Imath::V3d;
using support::measured;
using support::measuredOrder;

const V3d kFirst(0.013, 0.021, 0.037), kAxis(0.6, 0.48, 0.64), kSecond = kFirst + kAxis;

SegmentedField twoBalls(double voxel) {
  const std::vector<NarrowBand> balls = {makeSphere(1, kFirst, voxel),
                                         makeSphere(1, kSecond, voxel)};
  return segmentSolids(balls).field;
}

/// Distance from the first ball without the second one.
double crescentDistance(const V3d& p) {
  const V3d q = p - kFirst;
  const double along = q.dot(kAxis), across = (q - kAxis * along).length(), first = q.length() - 1,
               second = 1 - (p - kSecond).length();
  double least = std::hypot(along - 0.5, across - std::sqrt(0.75));  // the common circle
  if ((kFirst + q.normalized() - kSecond).length() >= 1) least = std::min(least, std::abs(first));
  if ((kSecond + (p - kSecond).normalized() - kFirst).length() <= 1)
    least = std::min(least, std::abs(second));
  return std::max(first, second) < 0 ? -least : least;
}

TEST(ExtractLabel, GivesExactDistancesWithSecondOrder) {
  std::vector<double> errors;
  for (const double voxel : {0.1, 0.05, 0.025}) {
    const NarrowBand band = extractLabel(twoBalls(voxel), 1);
    EXPECT_NEAR(band.halfWidth(), 3, 1e-6);
    EXPECT_TRUE(check(band).passed());
    errors.push_back(0);
    support::forEachActive(band, [&](const V3d& p, double value) {
      errors.back() = std::max(errors.back(), std::abs(value - crescentDistance(p)));
    });
  }
  EXPECT_LT(errors[2], measured(2.3e-4));  // 0.009 voxels
  EXPECT_GT(std::log2(errors[0] / errors[2]) / 2, measuredOrder(1.97));
}

TEST(ExtractLabel, KeepsGridAndSigns) {
  const SegmentedField field = twoBalls(0.1);
  const NarrowBand band = extractLabel(field, 2, {.halfWidth = 4});
  EXPECT_EQ(band.indexToWorld(), field.indexToWorld());
  EXPECT_NEAR(band.halfWidth(), 4, 1e-6);
  support::forEachActive(band, [&](const V3d& p, double value) {
    EXPECT_EQ(value < 0, SegmentedSampler(field).label(p) == 2);
  });
}

TEST(ExtractLabel, HasTheSameBitsWithAnyNumberOfThreads) {
  const SegmentedField field = twoBalls(0.1);
  const auto run = [&](std::size_t threads) {
    return support::onThreads(threads, [&] { return extractLabel(field, 1).contentHash(); });
  };
  EXPECT_EQ(run(1), run(4));
}

TEST(ExtractLabel, Refuses) {
  const SegmentedField field = twoBalls(0.1);
  EXPECT_THROW((void)extractLabel(field, kVoid), UsageError);
  EXPECT_THROW((void)extractLabel(field, 1, {.halfWidth = 0.5}), UsageError);
  EXPECT_THROW((void)extractLabel(field, 3), NoSurface);
  EXPECT_THROW((void)extractLabel(SegmentedField(), 1), NoSurface);
  EXPECT_THROW((void)extractLabel(field, 1, {.progress = [](double) { return false; }}), Cancelled);
}

}  // namespace extract_label_test
