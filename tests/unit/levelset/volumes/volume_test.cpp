#include "levelset/volumes/volume.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "levelset/error.h"
#include "levelset/volumes/histogram.h"
#include "levelset/volumes/synthetic.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"

namespace volume_test {

using Imath::M44d;
using Imath::V3d;
using Imath::V3i;
using levelset::InvalidInput;
using levelset::UsageError;
using levelset::Volume;
using levelset::VolumeGrid;
using support::measured;
using support::refusal;

Volume filled(const VolumeGrid& grid, const std::function<double(const V3i&)>& function) {
  std::vector<float> values;
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i)
        values.push_back(static_cast<float>(function(V3i(i, j, k))));
  return {grid, std::move(values)};
}

TEST(Volume, InterpolatesTrilinearly) {
  const auto value = [](const V3d& p) { return 1 + p.x - 2 * p.y + 3 * p.z + p.x * p.y * p.z; };
  const Volume volume = filled({V3i(4, 3, 5), {}}, [&](const V3i& p) { return value(V3d(p)); });
  for (const V3d& p : {V3d(0), V3d(0.25, 1.5, 3.75), V3d(3, 2, 4), V3d(2.5, 0.125, 0)})
    EXPECT_NEAR(volume.trilinear(p), value(p), 1e-12);
  // Positions outside are moved to the border.
  EXPECT_EQ(volume.trilinear(V3d(-1, 0, 0)), value(V3d(0)));
  EXPECT_EQ(volume.trilinear(V3d(9, 9, 9)), value(V3d(3, 2, 4)));
}

TEST(Volume, GridKnowsSpacingBoundsAndOrientation) {
  VolumeGrid grid{V3i(3, 4, 5), M44d(0, 2, 0, 0, -3, 0, 0, 0, 0, 0, -4, 0, 1, 1, 1, 1)};
  EXPECT_EQ(grid.spacing(), V3d(2, 3, 4));
  EXPECT_EQ(grid.bounds().min, V3d(-8, 1, -15));
  EXPECT_EQ(grid.bounds().max, V3d(1, 5, 1));
  EXPECT_EQ(grid.orientation(), "ALI");
  EXPECT_TRUE(grid.isOrthogonal());
  grid.indexToWorld[0][0] = 0.1;
  EXPECT_FALSE(grid.isOrthogonal());
}

TEST(Volume, RefusesUnusableGridsAndValues) {
  const auto made = [](const VolumeGrid& grid, std::vector<float> values) {
    return refusal<levelset::Error>([&] { (void)Volume(grid, std::move(values)); });
  };
  EXPECT_SAYS(made({V3i(2, 0, 2), {}}, {}), "2 x 0 x 2");
  EXPECT_SAYS(made({V3i(1, 1, 2), {}}, {1}), "1 values for a grid of 2");
  EXPECT_SAYS(made({V3i(1, 1, 2), {}}, {1, NAN}), "(0, 0, 1)");
  M44d flat;
  flat[2][2] = 0;
  EXPECT_SAYS(made({V3i(1, 1, 2), flat}, {1, 2}), "span no space");
}

TEST(Volume, CopiesShareNumbersAndHashesTellVolumesApart) {
  const Volume one = filled({V3i(2, 2, 2), {}}, [](const V3i& p) { return p.x; });
  const Volume copy = one;
  EXPECT_EQ(copy.contentHash(), one.contentHash());
  EXPECT_NE(filled({V3i(2, 2, 2), {}}, [](const V3i& p) { return p.y; }).contentHash(),
            one.contentHash());
  VolumeGrid moved{V3i(2, 2, 2), {}};
  moved.indexToWorld[3][0] = 1;
  EXPECT_NE(filled(moved, [](const V3i& p) { return p.x; }).contentHash(), one.contentHash());
}

// === Synthetic volumes

TEST(SyntheticVolumes, MarschnerLobbFollowsItsDefinition) {
  // Values by hand: at the origin the rings are cos(12 pi) = 1.
  EXPECT_NEAR(levelset::marschnerLobbAt(V3d(0)), (1 + 0.25 * 2) / 2.5, 1e-14);
  EXPECT_NEAR(levelset::marschnerLobbAt(V3d(0, 0, 1)), (1 - 1 + 0.5) / 2.5, 1e-14);
  // r = 2/3: cos(pi/3) = 1/2, and cos(6 pi) = 1.
  EXPECT_NEAR(levelset::marschnerLobbAt(V3d(0, 2.0 / 3, 0)), 0.6, 1e-13);
  // r = 1: cos(pi/2) = 0, and cos(0) = 1.
  EXPECT_NEAR(levelset::marschnerLobbAt(V3d(-1, 0, 0)), 0.6, 1e-13);
  const Volume volume = levelset::marschnerLobb(21);
  for (const V3i& p : {V3i(0), V3i(10, 10, 10), V3i(3, 17, 20)})
    EXPECT_NEAR(volume.at(p.x, p.y, p.z),
                levelset::marschnerLobbAt(V3d(p) * volume.grid().indexToWorld), 1e-7);
  EXPECT_EQ(volume.grid().bounds().min, V3d(-1));
  EXPECT_EQ(volume.grid().bounds().max, V3d(1));
}

TEST(SyntheticVolumes, BlurAddsVariancesInWorldUnits) {
  // A Gaussian blurred with a Gaussian is a Gaussian with the sum of the variances.
  M44d map;
  map.setScale(V3d(0.1, 0.2, 0.15));
  const VolumeGrid grid{V3i(61, 31, 41), map};
  const V3d center = V3d(30, 15, 20) * map;
  const auto gaussian = [&](const V3i& p, double sigma) {
    const double squared = (V3d(p) * map - center).length2();
    return std::exp(-squared / (2 * sigma * sigma)) / std::pow(sigma, 3);
  };
  const Volume blurred =
      levelset::blurred(filled(grid, [&](const V3i& p) { return gaussian(p, 0.4); }), 0.3);
  double worst = 0;
  for (int k = 0; k < 41; ++k)
    for (int j = 0; j < 31; ++j)
      for (int i = 0; i < 61; ++i)
        worst = std::max(worst, std::abs(blurred.at(i, j, k) - gaussian(V3i(i, j, k), 0.5)));
  EXPECT_LT(worst / gaussian(V3i(30, 15, 20), 0.5), measured(5.61e-5));
  const Volume constant = filled({V3i(5, 4, 3), {}}, [](const V3i&) { return 7; });
  EXPECT_NEAR(levelset::blurred(constant, 2).lowest(), 7, 1e-5);
  EXPECT_SAYS(refusal<UsageError>([&] { (void)levelset::blurred(constant, 0); }), "sigma");
}

// === Histogram

TEST(Histograms, CountEachIntegerAndFindClasses) {
  // Three groups of values with known limits: 10 ± 2, 100 ± 2 and 200 ± 2.
  const Volume volume = [&] {
    const VolumeGrid grid{V3i(30, 10, 10), {}};
    std::vector<std::uint8_t> bytes;
    for (int n = 0; n < 3000; ++n)
      bytes.push_back(static_cast<std::uint8_t>((n % 3 == 0   ? 10
                                                 : n % 3 == 1 ? 100
                                                              : 200) +
                                                n / 3 % 5 - 2));
    const auto owner = std::make_shared<std::vector<std::uint8_t>>(std::move(bytes));
    return Volume(grid, levelset::VolumeType::U8, {},
                  {owner, reinterpret_cast<const char*>(owner->data()), false});
  }();
  const levelset::VolumeHistogram found = levelset::histogram(volume);
  ASSERT_EQ(found.counts.size(), 195u);  // 8 to 202
  EXPECT_EQ(found.center(0), 8);
  EXPECT_EQ(found.counts[2], 200u);
  EXPECT_EQ(found.counts[50], 0u);
  ASSERT_EQ(found.otsu.size(), 2u);
  EXPECT_GT(found.otsu[0], 12);
  EXPECT_LT(found.otsu[0], 98);
  EXPECT_GT(found.otsu[1], 102);
  EXPECT_LT(found.otsu[1], 198);
}

TEST(Histograms, SteepestValueIsThatOfTheEdge) {
  // A blurred step in x from 0 to 10: the gradient is largest at 5, and known there.
  M44d map;
  map[0][0] = 0.5;
  const Volume volume = filled({V3i(60, 5, 5), map}, [](const V3i& p) {
    return 5 + 5 * std::erf((0.5 * (p.x - 29.5)) / (2 * std::numbers::sqrt2));
  });
  const levelset::VolumeHistogram found = levelset::histogram(volume, {.bins = 50});
  EXPECT_NEAR(found.steepest, 5, 1.01);
  const double steepest = *std::max_element(found.meanGradient.begin(), found.meanGradient.end());
  // Central differences of the error function with sigma = 2.
  EXPECT_NEAR(steepest, 10 / (2 * std::sqrt(2 * std::numbers::pi)), measured(0.0357));
  EXPECT_SAYS(refusal<UsageError>([&] { (void)levelset::histogram(volume, {.bins = 1}); }), "bins");
  EXPECT_SAYS(refusal<UsageError>([&] { (void)levelset::histogram(volume, {.classes = 1}); }),
              "classes");
}

}  // namespace volume_test
