#include "levelset/curvature_flow/curvature_rate_vdb.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include "tests/support/measured.h"

namespace curvature_rate_test {

using levelset::flow::BandBlocks;
using levelset::flow::PaddedBlock;
using levelset::flow::Values;

using Function = std::function<double(double, double, double)>;

/// Largest error of κ|∇φ| at the grid points of a block where `counts` is true, in voxels⁻¹.
double rateError(const Function& field, const Function& exact,
                 const std::function<bool(int, int, int)>& counts) {
  const auto block = std::make_unique<PaddedBlock>();
  block->values.fill(0);
  for (int x = -2; x < 10; ++x)
    for (int y = -2; y < 10; ++y)
      for (int z = -2; z < 10; ++z)
        block->values[PaddedBlock::slot(x, y, z)] = static_cast<float>(field(x, y, z));
  const auto rate = std::make_unique<Values>();
  curvatureRate(*block, BandBlocks::Mask(true), 0, *rate);
  double worst = 0;
  int count = 0;
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z) {
        if (!counts(x, y, z)) continue;
        ++count;
        const auto found =
            static_cast<double>((*rate)[static_cast<std::size_t>(64 * x + 8 * y + z)]);
        worst = std::max(worst, std::abs(found - exact(x, y, z)));
      }
  EXPECT_GT(count, 10);
  return worst;
}

/// Error on the exact distance from a point, times the distance, where that is `r` ± 15 %.
double sphereError(double r) {
  const auto distance = [](double x, double y, double z) {
    return std::hypot(x - 0.2, y - 3.41, z - 3.77);
  };
  return r * rateError(
                 distance, [&](double x, double y, double z) { return 2 / distance(x, y, z); },
                 [&](int x, int y, int z) { return std::abs(distance(x, y, z) / r - 1) < 0.15; });
}

TEST(CurvatureRate, ConvergesOnSpheres) {
  const double coarse = sphereError(3), fine = sphereError(6);
  EXPECT_LE(coarse, support::measured(0.0175));
  EXPECT_LE(fine, support::measured(0.00159));
  EXPECT_GE(std::log2(coarse / fine), support::measuredOrder(3.46));
}

// The correction from second to fourth order is bounded. The bound must lie above the corrections
// of a ripple with a wavelength of six voxels.
TEST(CurvatureRate, ResolvesRipples) {
  const double k = 2 * M_PI / 6;
  const double error =
      rateError([&](double x, double, double z) { return z - std::sin(k * x + 0.4); },
                [&](double x, double, double) {
                  const double slope = k * std::cos(k * x + 0.4);
                  return k * k * std::sin(k * x + 0.4) / (1 + slope * slope);
                },
                [](int, int, int) { return true; });
  EXPECT_LE(error, support::measured(0.0118));
}

}  // namespace curvature_rate_test
