// Volumes on other grids.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "levelset/error.h"
#include "levelset/volumes/filters/filtered_volume.h"
#include "levelset/volumes/filters/resample_volume.h"
#include "tests/support/measured.h"
#include "tests/support/volumes.h"

namespace resample_volume_test {

using namespace levelset;
using Imath::V3d;
using Imath::V3i;
using support::measured;

/// Grid with three spacings and turned axes around a point.
VolumeGrid turnedGrid(int n, const V3d& middle) {
  VolumeGrid grid;
  grid.size = {n, n + 3, n - 2};
  const V3d half = 0.5 * V3d(grid.size - V3i(1));
  grid.indexToWorld = Imath::M44d().setTranslation(-half);
  Imath::M44d scale, turn, move;
  scale.setScale(V3d(2.0 / n, 2.4 / n, 1.7 / n));
  turn.setEulerAngles(V3d(0.3, -0.5, 0.8));
  move.setTranslation(middle);
  grid.indexToWorld = grid.indexToWorld * scale * turn * move;
  return grid;
}

/// Largest error of a resampled volume at points that lie well within the source.
double errorOf(const Volume& volume, const Volume& source, double margin,
               const std::function<double(const V3d&)>& truth) {
  const Imath::M44d toSource = volume.grid().indexToWorld * source.grid().indexToWorld.inverse();
  double largest = 0;
  int compared = 0;
  for (int k = 0; k < volume.size().z; ++k)
    for (int j = 0; j < volume.size().y; ++j)
      for (int i = 0; i < volume.size().x; ++i) {
        const V3d at = V3d(i, j, k) * toSource;
        bool isWithin = true;
        for (int axis = 0; axis < 3; ++axis)
          isWithin = isWithin && at[axis] > margin && at[axis] < source.size()[axis] - 1 - margin;
        if (!isWithin) continue;
        ++compared;
        const double exact = truth(V3d(i, j, k) * volume.grid().indexToWorld);
        largest = std::max(largest, std::abs(volume.at(i, j, k) - exact));
      }
  EXPECT_GT(compared, 100);
  return largest;
}

TEST(ResampleVolume, CoversTheBoundsAtMultiplesOfTheSpacing) {
  VolumeGrid grid;
  grid.size = {11, 6, 3};
  grid.indexToWorld = Imath::M44d(0.1, 0, 0, 0, 0, 0.3, 0, 0, 0, 0, -0.7, 0, -0.5, 0.25, 2, 1);
  const VolumeGrid made = resampledGrid(grid, 0.1);
  EXPECT_EQ(made.size, V3i(11, 17, 15));  // x: −0.5 … 0.5, y: 0.2 … 1.8 outwards, z: 0.6 … 2
  EXPECT_NEAR(made.indexToWorld[3][0], -0.5, 1e-12);
  EXPECT_NEAR(made.indexToWorld[3][1], 0.2, 1e-12);
  EXPECT_NEAR(made.indexToWorld[3][2], 0.6, 1e-12);
  for (const double spacing : {0.0, -1.0, std::nan(""), HUGE_VAL})
    EXPECT_THROW((void)resampledGrid(grid, spacing), UsageError);
  EXPECT_THROW((void)resampledGrid(grid, 1e-10), ResourceLimit);
  const Volume volume = support::sampled(grid, [](const V3d& p) { return p.x; });
  EXPECT_THROW((void)resampled(volume, 0.001, {.maxMemory = 1u << 20}), ResourceLimit);
}

TEST(ResampleVolume, KeepsThePolynomialsOfTheFilter) {
  const auto quadratic = [](const V3d& p) { return 1 + p.x * p.y - 2 * p.z * p.z + p.x - p.z; };
  const Volume volume = support::sampled(turnedGrid(12, V3d(0.1, 0.2, -0.3)), quadratic);
  for (const VolumeFilter filter : {VolumeFilter::Tricubic, VolumeFilter::BSplineQi})
    EXPECT_LT(errorOf(resampled(volume, 0.11, {.filter = filter}), volume, 0, quadratic),
              measured(1.5e-6));
  // At its own grid points, an interpolating filter returns the samples.
  const Volume straight = support::sampled(support::cubeGrid(13), quadratic);
  VolumeGrid whole = straight.grid();
  whole.indexToWorld = Imath::M44d();
  const Volume unit = support::sampled(whole, quadratic);
  const Volume same = resampled(unit, 1, {.filter = VolumeFilter::Tricubic});
  ASSERT_EQ(same.size(), unit.size());
  for (std::size_t n = 0; n < same.grid().pointCount(); ++n)
    EXPECT_EQ(same.stored(n), unit.stored(n));
}

TEST(ResampleVolume, ConvergesWithTheOrderOfTheFilter) {
  const auto wave = [](const V3d& p) { return std::sin(2 * p.x + p.y) * std::cos(1.5 * p.z); };
  for (const auto& [filter, order] : {std::pair(VolumeFilter::Trilinear, 2.0),
                                      {VolumeFilter::Tricubic, 3.0},
                                      {VolumeFilter::BSplineQi, 4.0},
                                      {VolumeFilter::CubicC1, 2.0}}) {
    std::array<double, 3> errors{};
    for (std::size_t n = 0; n < 3; ++n) {
      const Volume volume = support::sampled(turnedGrid(12 << n, V3d(0)), wave);
      errors[n] = errorOf(resampled(volume, 0.07, {.filter = filter}), volume, 2, wave);
    }
    for (std::size_t n = 0; n < 2; ++n)
      EXPECT_NEAR(std::log2(errors[n] / errors[n + 1]), order, 0.45)
          << factsOf(filter).name << " " << errors[n];
  }
}

TEST(ResampleVolume, WorksFarFromTheOriginAndOnAnyNumberOfThreads) {
  const V3d far(1e6, -2e6, 5e5);
  const auto ramp = [&](const V3d& p) { return (p - far).dot(V3d(1, 2, -1)); };
  const Volume volume = support::sampled(turnedGrid(10, far), ramp);
  const Volume parallel = resampled(volume, 0.1, {.filter = VolumeFilter::Trilinear});
  EXPECT_LT(errorOf(parallel, volume, 0, ramp), measured(1e-6));
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Volume serial = resampled(volume, 0.1, {.filter = VolumeFilter::Trilinear});
  EXPECT_EQ(parallel.contentHash(), serial.contentHash());
  // Outside the turned box, the values of its border continue.
  EXPECT_GE(parallel.lowest(), volume.lowest() - 1e-6);
  EXPECT_LE(parallel.highest(), volume.highest() + 1e-6);
}

}  // namespace resample_volume_test
