// Directions and shares of light at a surface between two media.

#include "render/optics/fresnel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/measured.h"

namespace fresnel_test {

using Imath::V3d;
using namespace render;

constexpr double kRatios[] = {1 / 2.4, 1 / 1.5, 1 / 1.1, 1, 1.0003, 1.33, 1.5, 2.4, 10};

V3d rayAt(double angle) {
  return {std::sin(angle), 0, -std::cos(angle)};
}

TEST(Fresnel, RefractsBySnellsLaw) {
  const V3d normal(0, 0, 1);
  for (const double ratio : kRatios)
    for (double angle = 0; angle < 1.57; angle += 0.05) {
      const auto behind = refracted(rayAt(angle), normal, ratio);
      if (std::sin(angle) > ratio) {
        EXPECT_FALSE(behind) << ratio << " " << angle;
        continue;
      }
      ASSERT_TRUE(behind) << ratio << " " << angle;
      EXPECT_NEAR(behind->x * ratio, std::sin(angle), support::doubleRounding(8));
      EXPECT_NEAR(behind->length(), 1, support::doubleRounding(16));
      EXPECT_LE(behind->z, 0);
    }
}

TEST(Fresnel, HasTheClosedFormsStraightOnAtBrewstersAngleAndGrazing) {
  for (const double ratio : kRatios) {
    const double straight = (ratio - 1) / (ratio + 1), square = ratio * ratio;
    EXPECT_NEAR(fresnelShare(1, ratio), straight * straight, support::doubleRounding(8)) << ratio;
    // At Brewster's angle one polarisation is not reflected.
    const double across = (1 - square) / (1 + square);
    EXPECT_NEAR(fresnelShare(std::cos(std::atan(ratio)), ratio), 0.5 * across * across,
                support::doubleRounding(64))
        << ratio;
    EXPECT_EQ(fresnelShare(0, ratio), ratio == 1 ? 0 : 1);
  }
}

TEST(Fresnel, ReflectsAllBeyondTheCriticalAngle) {
  const double critical = std::asin(1 / 1.5);
  EXPECT_LT(fresnelShare(std::cos(critical - 1e-4), 1 / 1.5), 0.97);
  EXPECT_EQ(fresnelShare(std::cos(critical + 1e-9), 1 / 1.5), 1);
}

TEST(Fresnel, KeepsTheEnergy) {
  // The transmittance has formulas of its own.
  for (const double ratio : kRatios)
    for (double angle = 0; angle < 1.57; angle += 0.05) {
      const double sine = std::sin(angle) / ratio, cosine = std::cos(angle);
      if (sine >= 1) continue;
      const double behind = std::sqrt(1 - sine * sine);
      const double across = 2 * cosine / (cosine + ratio * behind),
                   along = 2 * cosine / (ratio * cosine + behind);
      const double transmitted = ratio * behind / cosine * 0.5 * (across * across + along * along);
      EXPECT_NEAR(fresnelShare(cosine, ratio) + transmitted, 1, support::doubleRounding(64))
          << ratio << " " << angle;
    }
}

TEST(Fresnel, IsTheSameInBothDirections) {
  for (const double ratio : kRatios)
    for (double angle = 0; angle < 1.5; angle += 0.1) {
      const double sine = std::sin(angle) / ratio;
      if (sine >= 1) continue;
      EXPECT_NEAR(fresnelShare(std::cos(angle), ratio),
                  fresnelShare(std::sqrt(1 - sine * sine), 1 / ratio),
                  support::doubleRounding(256));
    }
}

TEST(Fresnel, OfAMirrorGrowsFromItsShareToOne) {
  EXPECT_EQ(schlickShare(0.2, 1), 0.2);
  EXPECT_EQ(schlickShare(0.2, 0), 1);
  EXPECT_EQ(schlickShare(1, 0.3), 1);
}

}  // namespace fresnel_test
