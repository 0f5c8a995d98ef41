// Pictures of the distance in a plane.

#include "render/views/slice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/measured.h"

namespace slice_test {

using Imath::V3d;
using namespace render;

const levelset::NarrowBand& ball() {
  static const levelset::NarrowBand band = levelset::makeSphere(1, V3d(0.3, 0.2, 0.1), 0.05);
  return band;
}

TEST(Slice, HasTheDistanceAtItsPixels) {
  for (const V3d& normal : {V3d(0, 0, 2), V3d(1, 0, 0), V3d(0, -3, 0), V3d(1, 2, -1)}) {
    const V3d point(0.5, 0.1, 0.2);
    const Image image =
        drawSlice(ball(), {.point = point, .normal = normal, .width = 200, .height = 120});
    std::size_t inBand = 0;
    for (std::size_t i = 0; i < image.pixelCount(); ++i) {
      const V3d p(static_cast<double>(image.channels.at("P.X")[i]),
                  static_cast<double>(image.channels.at("P.Y")[i]),
                  static_cast<double>(image.channels.at("P.Z")[i]));
      ASSERT_NEAR((p - point).dot(normal.normalized()), 0, support::rounding(1.25));
      const double distance = (p - V3d(0.3, 0.2, 0.1)).length() - 1;
      const auto phi = static_cast<double>(image.channels.at("phi")[i]);
      if (std::abs(distance) > 0.1) {
        ASSERT_EQ(phi < 0, distance < 0);
        continue;
      }
      ++inBand;
      ASSERT_NEAR(phi, distance, support::measured(0.248, 0.25) * 0.05 * 0.05 * 1.2);
    }
    EXPECT_GT(inBand, 1000u);
  }
}

TEST(Slice, IsSeenFromTheSideOfTheNormal) {
  const auto cornersOf = [](const V3d& normal) {
    const Image image = drawSlice(ball(), {.normal = normal, .width = 100, .height = 80});
    const auto at = [&](std::size_t x, std::size_t y) {
      const std::size_t i = y * 100 + x;
      return V3d(static_cast<double>(image.channels.at("P.X")[i]),
                 static_cast<double>(image.channels.at("P.Y")[i]),
                 static_cast<double>(image.channels.at("P.Z")[i]));
    };
    const V3d right = at(99, 40) - at(0, 40), up = at(50, 0) - at(50, 79);
    return std::pair(right.normalized(), up.normalized());
  };
  for (const V3d& normal : {V3d(0, 0, 1), V3d(0, 0, -1), V3d(1, 0, 0), V3d(0, 1, 0)}) {
    const auto [right, up] = cornersOf(normal);
    EXPECT_LT((right.cross(up) - normal).length(), support::rounding(1)) << normal;
    EXPECT_GT(up.dot(normal.z != 0 ? V3d(0, 1, 0) : V3d(0, 0, 1)), 0.999) << normal;
  }
}

TEST(Slice, HasABlackZeroLineAndALineForEachStep) {
  // Outwards from the middle of the ball, through 3 voxels on either side.
  const Image image =
      drawSlice(ball(), {.point = V3d(0, 0, 0.1), .width = 1200, .height = 1200, .step = 0.05});
  const std::vector<float>&red = image.channels.at("R"), &phi = image.channels.at("phi");
  int zeroLines = 0, minima = 0;
  for (std::size_t x = 600; x + 1 < 1200; ++x) {
    const std::size_t i = 600 * 1200 + x;
    if (red[i] < 0.05f && red[i - 1] >= 0.05f) {
      ++zeroLines;
      EXPECT_NEAR(phi[i], 0, support::measured(7.75e-5));
    }
    if (red[i] < red[i - 1] - 0.02f && red[i] <= red[i + 1]) ++minima;
  }
  EXPECT_EQ(zeroLines, 1);
  EXPECT_GE(minima, 5);  // steps −2 … 2
}

TEST(Slice, RefusesInvalidSlices) {
  EXPECT_THROW((void)drawSlice(ball(), {.normal = V3d(0)}), levelset::UsageError);
  EXPECT_THROW((void)drawSlice(ball(), {.point = V3d(std::nan(""))}), levelset::UsageError);
  EXPECT_THROW((void)drawSlice(ball(), {.width = 0}), levelset::UsageError);
  EXPECT_THROW((void)drawSlice(ball(), {.step = -1}), levelset::UsageError);
  EXPECT_THROW((void)drawSlice(ball(), {.width = 1 << 20, .height = 1 << 20}),
               levelset::ResourceLimit);
  EXPECT_THROW((void)drawSlice({}, {}), levelset::InvalidInput);
}

}  // namespace slice_test
