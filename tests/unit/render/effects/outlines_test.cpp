// Outlines by Sobel's masks: steps, creases and silhouettes with known places and widths.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "levelset/error.h"
#include "render/effects/effects.h"
#include "render/effects/picture_view.h"
#include "tests/support/effect_pictures.h"

namespace outlines_test {

using Imath::V3d;
using support::onBall;
using support::onPlane;
using support::pictureOf;
using support::straightCamera;
using support::SurfacePoint;
using namespace render;

constexpr double kDegree = std::numbers::pi / 180;

std::vector<float> outlinesOf(const Image& image, const OutlineNumbers& of) {
  return outlineLayer(PictureView(image), of, CpuScreenRunner());
}

double largestOf(const std::vector<float>& values) {
  return static_cast<double>(*std::max_element(values.begin(), values.end()));
}

/// Two planes across the view, the right one `jump` farther away.
Image step(double jump) {
  return pictureOf(
      straightCamera(32, 16),
      [&](const Camera::Ray& ray) {
        return onPlane(ray, V3d(0, 0, ray.origin.x < 0 ? 0 : -jump), V3d(0, 0, 1));
      },
      50);
}

/// Roof with a vertical ridge and the given angle between its normals.
Image roof(double angle) {
  return pictureOf(
      straightCamera(32, 16),
      [&](const Camera::Ray& ray) {
        const double side = ray.origin.x < 0 ? -1 : 1;
        return onPlane(ray, V3d(0), V3d(side * std::sin(angle / 2), 0, std::cos(angle / 2)));
      },
      50);
}

TEST(Outlines, AreNotOnPlanesHoweverSteep) {
  for (const double degrees : {0.0, 45.0, 80.0, 88.0}) {
    Camera camera;
    camera.from = V3d(0, 0, 40);
    camera.width = 64;
    camera.height = 48;
    const V3d normal(std::sin(degrees * kDegree), 0, std::cos(degrees * kDegree));
    const Image image = pictureOf(
        camera, [&](const Camera::Ray& ray) { return onPlane(ray, V3d(0), normal); }, 20);
    const std::vector<float> lines = outlinesOf(image, {.width = 2, .step = 0.2});
    // Steep planes end at a horizon in the picture, which is an outline.
    std::size_t inside = 0;
    for (int y = 4; y < 44; ++y)
      for (int x = 4; x < 60; ++x) {
        bool isInside = true;
        for (int dx = -3; dx <= 3; ++dx)
          isInside =
              isInside &&
              std::isfinite(image.channels.at("Z")[static_cast<std::size_t>(64 * y + x + dx)]);
        if (!isInside) continue;
        ++inside;
        EXPECT_EQ(lines[static_cast<std::size_t>(64 * y + x)], 0.0f) << degrees;
      }
    EXPECT_GT(inside, 500u) << degrees;
  }
}

TEST(Outlines, HaveTheirWidth) {
  for (const double width : {0.5, 1.0, 2.0, 3.0, 4.5, 8.0}) {
    const std::vector<float> lines = outlinesOf(step(10), {.width = width, .step = 5});
    double sum = 0, middle = 0;
    for (int x = 0; x < 32; ++x) {
      const double weight = static_cast<double>(lines[static_cast<std::size_t>(32 * 8 + x)]);
      sum += weight;
      middle += weight * (x + 0.5);
    }
    EXPECT_NEAR(sum, width, 1e-5);
    EXPECT_NEAR(middle / sum, 16, 1e-5);
  }
}

TEST(Outlines, BeginAtTheStep) {
  EXPECT_EQ(largestOf(outlinesOf(step(1), {.step = 5})), 0);
  EXPECT_EQ(largestOf(outlinesOf(step(5), {.step = 5})), 1);
  EXPECT_EQ(largestOf(outlinesOf(step(20), {.step = 100})), 0);
}

TEST(Outlines, BeginAtTheCreaseAngle) {
  // The ramp of the weight lies between 3/4 and 5/4 of the difference of the normals.
  const auto weight = [](double angle) {
    return largestOf(
        outlinesOf(roof(angle * kDegree), {.width = 2, .step = 50, .crease = 40 * kDegree}));
  };
  EXPECT_EQ(weight(29), 0);
  EXPECT_NEAR(weight(40), 0.5, 2e-6);
  EXPECT_EQ(weight(51), 1);
}

TEST(Outlines, AreNotOnCreasesAtAnAngleOf180Degrees) {
  const Image image = roof(150 * kDegree);
  EXPECT_EQ(largestOf(outlinesOf(image, {.step = 50, .crease = 180 * kDegree})), 0);
  EXPECT_GT(largestOf(outlinesOf(image, {.step = 50, .crease = 120 * kDegree})), 0.5);
}

TEST(Outlines, FollowTheSilhouetteOfABall) {
  constexpr double kRadius = 30, kWidth = 3;
  const Image image = pictureOf(
      straightCamera(96, 96), [&](const Camera::Ray& ray) { return onBall(ray, V3d(0), kRadius); },
      2 * kRadius);
  const std::vector<float> lines =
      outlinesOf(image, {.width = kWidth, .step = 1, .crease = 180 * kDegree});
  double area = 0;
  for (int y = 0; y < 96; ++y)
    for (int x = 0; x < 96; ++x) {
      const double offset = std::abs(std::hypot(x + 0.5 - 48, y + 0.5 - 48) - kRadius);
      const double weight = static_cast<double>(lines[static_cast<std::size_t>(96 * y + x)]);
      area += weight;
      if (offset > kWidth / 2 + 1.5) {
        EXPECT_EQ(weight, 0) << x << "," << y;
      }
      if (offset < 0.5) {
        EXPECT_GT(weight, 0.9) << x << "," << y;
      }
    }
  const double exact = 2 * std::numbers::pi * kRadius * kWidth;
  EXPECT_NEAR(area / exact, 1, 0.2) << area / exact;
}

TEST(Outlines, RefusePicturesWithoutLayersOrCamera) {
  Image image = step(10);
  const auto refusal = [](const Image& of) {
    try {
      (void)outlinesOf(of, {});
    } catch (const levelset::InvalidInput& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  Image lacking = image;
  lacking.channels.erase("N.Y");
  EXPECT_NE(refusal(lacking).find("N.Y"), std::string::npos);
  lacking = image;
  lacking.channels.erase("Z");
  EXPECT_NE(refusal(lacking).find("render FILE.exr"), std::string::npos);
  lacking = image;
  lacking.matrices.clear();
  EXPECT_NE(refusal(lacking).find("no camera"), std::string::npos);
  lacking = image;
  lacking.matrices["worldToNDC"] = std::vector<float>(16, 0);
  EXPECT_NE(refusal(lacking).find("not those of a camera"), std::string::npos);
}

TEST(Outlines, OfAPictureWithoutSurfacesAreEmpty) {
  const Image image = pictureOf(
      straightCamera(8, 8), [](const Camera::Ray&) { return std::optional<SurfacePoint>(); }, 1);
  EXPECT_EQ(largestOf(outlinesOf(image, {.step = 1})), 0);
}

}  // namespace outlines_test
