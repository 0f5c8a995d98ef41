// Effects that replace or mix colours: patterns in space, environment, lines, fog and reduction.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>

#include "levelset/error.h"
#include "render/effects/effects.h"
#include "render/effects/picture_view.h"
#include "render/effects/solid_pattern.h"
#include "render/shading/style.h"
#include "tests/support/effect_pictures.h"
#include "tests/support/environment_maps.h"

namespace surface_effects_test {

using Imath::V3d;
using support::onBall;
using support::onPlane;
using support::pictureOf;
using support::straightCamera;
using namespace render;

const CpuScreenRunner kRunner;

double at(const Image& image, const char* channel, int x, int y) {
  return static_cast<double>(image.channels.at(
      channel)[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
               static_cast<std::size_t>(x)]);
}

Image ball(const Camera& camera) {
  return pictureOf(
      camera, [](const Camera::Ray& ray) { return onBall(ray, V3d(0), 12); }, 24);
}

TEST(DisplayCurve, HasItsInverse) {
  for (int i = 0; i <= 998; ++i) {
    const double shown = i / 1000.0;
    EXPECT_NEAR(displayOfLinear(linearOfDisplay(shown)), shown, 1e-14);
  }
  Image white(1, 1);
  for (const char* name : {"R", "G", "B"})
    white.addChannel(name, static_cast<float>(linearOfDisplay(1)));
  EXPECT_EQ(displayColours(white)[0], 255);
}

TEST(SolidPattern, OfACheckerHasTheParityOfTheCell) {
  const V3d bright = patternColour(SolidTexture::Checker, V3d(0.5));
  EXPECT_EQ(patternColour(SolidTexture::Checker, V3d(1.5, 0.5, 0.5)),
            patternColour(SolidTexture::Checker, V3d(-0.5, 0.5, 0.5)));
  EXPECT_NE(patternColour(SolidTexture::Checker, V3d(1.5, 0.5, 0.5)), bright);
  EXPECT_EQ(patternColour(SolidTexture::Checker, V3d(1.5, 1.5, 0.5)), bright);
}

TEST(SolidPattern, IsFiniteAtHugeAndUndefinedPlaces) {
  Image image = ball(straightCamera(8, 8));
  image.channels["P.X"][27] = std::numeric_limits<float>::quiet_NaN();
  EffectOptions options;
  options.textureSize = 1e-20;
  for (const SolidTexture texture :
       {SolidTexture::Checker, SolidTexture::Noise, SolidTexture::Marble, SolidTexture::Wood}) {
    options.solidTexture = texture;
    const Image carved = withEffects(image, {}, options, kRunner);
    for (const float red : carved.channels.at("R")) EXPECT_TRUE(std::isfinite(red));
    EXPECT_EQ(carved.channels.at("R")[27], image.channels.at("R")[27]);
  }
}

TEST(SolidPattern, StaysInSpaceWhenTheCameraMoves) {
  Camera a = straightCamera(40, 40), b = a;
  b.from.x += 3;
  b.to.x += 3;
  EffectOptions options;
  options.solidTexture = SolidTexture::Marble;
  options.textureSize = 7;
  const auto drawn = [&](const Camera& camera) {
    return withEffects(ball(camera), {}, options, kRunner);
  };
  const Image first = drawn(a), second = drawn(b);
  for (int y = 10; y < 30; ++y)
    for (int x = 12; x < 28; ++x)
      EXPECT_NEAR(at(first, "R", x, y), at(second, "R", x - 3, y), 1e-4) << x << "," << y;
}

TEST(Environment, IsMirroredByTheLawOfReflection) {
  const support::EnvironmentFile map(support::directionLight);
  EffectOptions options;
  options.reflect = 1;
  options.environment = map.name();
  const Image image = ball(straightCamera(40, 40));
  const Image mirrored = withEffects(image, {}, options, kRunner);
  double worst = 0;
  for (int y = 10; y < 30; ++y)
    for (int x = 10; x < 30; ++x) {
      if (!std::isfinite(at(image, "Z", x, y))) continue;
      const V3d n(at(image, "N.X", x, y), at(image, "N.Y", x, y), at(image, "N.Z", x, y));
      const V3d exact = V3d(0, 0, -1) + n * (2 * n.z);
      worst = std::max({worst, std::abs(at(mirrored, "R", x, y) - 0.5 - 0.5 * exact.x),
                        std::abs(at(mirrored, "G", x, y) - 0.5 - 0.5 * exact.y),
                        std::abs(at(mirrored, "B", x, y) - 0.5 - 0.5 * exact.z)});
    }
  EXPECT_LT(worst, 1.5e-4) << worst;  // bilinear interpolation in 512 pixels
}

TEST(Environment, IsThatOfGlassBySnellsLawAndFresnelsEquations) {
  const support::EnvironmentFile map(support::directionLight);
  EffectOptions options;
  options.refract = 1;
  options.environment = map.name();
  for (const double index : {1.0, 1.33, 2.4}) {
    options.index = index;
    const Image image = ball(straightCamera(40, 40));
    const Image seen = withEffects(image, {}, options, kRunner);
    for (int x = 20; x < 31; ++x) {
      const V3d n(at(image, "N.X", x, 20), at(image, "N.Y", x, 20), at(image, "N.Z", x, 20));
      const V3d d(2 * at(seen, "R", x, 20) - 1, 2 * at(seen, "G", x, 20) - 1,
                  2 * at(seen, "B", x, 20) - 1);
      const double c = n.z, behind = std::sqrt(1 - (1 - c * c) / (index * index));
      const V3d through = V3d(0, 0, -1) / index + n * (c / index - behind);
      EXPECT_LT(through.dot(n), 0) << index << " " << x;
      // Fresnel's equations, for both polarisations.
      const double across = (c - index * behind) / (c + index * behind),
                   along = (index * c - behind) / (index * c + behind),
                   share = 0.5 * (across * across + along * along);
      const V3d exact = (V3d(0, 0, -1) + n * (2 * c)) * share + through * (1 - share);
      EXPECT_LT((d - exact).length(), 2e-4) << index << " " << x;
    }
  }
}

TEST(Environment, RefusesOtherPictures) {
  Image narrow(8, 8);
  for (const char* name : {"R", "G", "B"}) narrow.addChannel(name);
  const std::filesystem::path file = std::filesystem::temp_directory_path() /
                                     ("levelsmith-narrow-" + std::to_string(::getpid()) + ".exr");
  writeImage(file, narrow);
  EffectOptions options;
  options.reflect = 1;
  options.environment = file.string();
  EXPECT_THROW((void)withEffects(ball(straightCamera(8, 8)), {}, options, kRunner),
               levelset::InvalidInput);
  std::filesystem::remove(file);
  EXPECT_THROW((void)withEffects(ball(straightCamera(8, 8)), {}, options, kRunner),
               levelset::IoError);
}

TEST(ReflectionLines, AreThoseOfTheStyle) {
  const Image image = ball(straightCamera(40, 40));
  EffectOptions options;
  options.reflectionLines = 8;
  const Image lines = withEffects(image, {}, options, kRunner);
  for (int x = 12; x < 28; ++x) {
    const V3d n =
        V3d(at(image, "N.X", x, 15), at(image, "N.Y", x, 15), at(image, "N.Z", x, 15)).normalized();
    const Imath::C3f exact = reflectionLinesColour(n, V3d(0, 0, -1), V3d(0, 1, 0), V3d(1, 0, 0), 8);
    EXPECT_NEAR(at(lines, "G", x, 15), static_cast<double>(exact.y), 2e-5) << x;
  }
}

TEST(DepthCue, FadesLinearlyToTheBackground) {
  const Image image = pictureOf(
      straightCamera(32, 32),
      [](const Camera::Ray& ray) { return onPlane(ray, V3d(0), V3d(-1, 0, 1).normalized()); }, 50);
  LookOptions look;
  look.depthCue = 1;
  look.background = V3d(0.2, 0.4, 0.6);
  const Image cued = withLook(image, look, 1, kRunner);
  // The plane rises to the right, so the left edge is the farthest.
  const double plain = displayOfLinear(0.5);
  for (int x = 0; x < 32; ++x) {
    const double share = 1 - x / 31.0;
    EXPECT_NEAR(displayOfLinear(at(cued, "B", x, 5)), plain + (0.6 - plain) * share, 2e-6);
  }
  look.depthCueNear = 10;
  look.depthCueFar = 20;  // nearer than all surfaces: only background is left
  EXPECT_NEAR(displayOfLinear(at(withLook(image, look, 1, kRunner), "R", 31, 5)), 0.2, 1e-6);
  look.depthCueNear.reset();  // the nearest surface, which is farther than depthCueFar
  EXPECT_NEAR(displayOfLinear(at(withLook(image, look, 1, kRunner), "R", 31, 5)), 0.2, 1e-6);
}

TEST(Background, KeepsTheBitsOfOpaquePixels) {
  Image image = ball(straightCamera(32, 32));
  image.addChannel("R", 5);  // brighter than the display shows
  LookOptions look;
  look.background = V3d(1);
  const Image painted = withLook(image, look, 1, kRunner);
  EXPECT_EQ(at(painted, "R", 16, 16), 5);
  EXPECT_EQ(at(painted, "A", 0, 0), 1);
  EXPECT_NEAR(displayOfLinear(at(painted, "G", 0, 0)), 1, 2e-3);
}

TEST(DepthCue, KeepsTheBitsOfSurfacesThatDoNotFade) {
  Image image = ball(straightCamera(32, 32));
  image.addChannel("R", 5);
  LookOptions look;
  look.depthCue = 1;
  look.depthCueNear = 200;  // farther than all surfaces
  EXPECT_EQ(withLook(image, look, 1, kRunner).channels, image.channels);
}

TEST(Halo, IsOnFartherSurfacesOnly) {
  const Image image = pictureOf(
      straightCamera(32, 16),
      [](const Camera::Ray& ray) {
        return onPlane(ray, V3d(0, 0, ray.origin.x < 0 ? 0 : -10), V3d(0, 0, 1));
      },
      50);
  LookOptions look;
  look.halo = 4;
  const Image rimmed = withLook(image, look, 1, kRunner);
  const double plain = displayOfLinear(0.5);
  for (int x = 0; x < 16; ++x) EXPECT_EQ(at(rimmed, "R", x, 8), 0.5);
  for (int x = 16; x < 32; ++x) {
    const double share = std::clamp((4.5 - (x - 15)) / 4, 0.0, 1.0);
    EXPECT_NEAR(displayOfLinear(at(rimmed, "R", x, 8)), plain + (1 - plain) * share, 2e-3) << x;
  }
}

TEST(Xray, ShowsTheThickness) {
  Image image = ball(straightCamera(32, 32));
  LookOptions look;
  look.xray = 10;
  EXPECT_THROW((void)withLook(image, look, 1, kRunner), levelset::InvalidInput);
  image.addChannel("thickness", 10);
  const Image seen = withLook(image, look, 1, kRunner);
  EXPECT_NEAR(displayOfLinear(at(seen, "B", 16, 16)), 1 - std::exp(-1), 1e-6);
  EXPECT_EQ(at(seen, "A", 3, 3), 0);
  look.background = V3d(0.2, 0.4, 0.6);
  const Image before = withLook(image, look, 1, kRunner);
  EXPECT_EQ(at(before, "B", 16, 16), at(seen, "B", 16, 16));
  EXPECT_NEAR(displayOfLinear(at(before, "B", 3, 3)), 0.6, 1e-6);
}

TEST(Reduction, KeepsEvenColoursAndTheMiddleOfLayers) {
  const Image image = ball(straightCamera(33, 33));
  const Image small = reducedPicture(image, 3);
  EXPECT_EQ(small.width, 11);
  EXPECT_EQ(small.matrices, image.matrices);
  EXPECT_NEAR(at(small, "R", 5, 5), 0.5, 1e-6);
  EXPECT_EQ(at(small, "A", 5, 5), 1);
  EXPECT_EQ(at(small, "Z", 5, 5), at(image, "Z", 16, 16));
  // The opacity at the outline is the share of covered pixels.
  double sum = 0, all = 0;
  for (const float a : small.channels.at("A")) sum += static_cast<double>(a);
  for (const float a : image.channels.at("A")) all += static_cast<double>(a);
  EXPECT_NEAR(9 * sum, all, 1e-4);
  for (const int edge : {2, 34})
    EXPECT_THROW((void)reducedPicture(image, edge), levelset::UsageError) << edge;
}

TEST(Effects, WithoutOptionsKeepThePicture) {
  const Image image = ball(straightCamera(16, 16));
  EXPECT_EQ(withEffects(image, {}, {}, kRunner).channels, image.channels);
}

TEST(Effects, RefuseNumbersOutOfRange) {
  LookOptions look;
  look.depthCue = 1.5;
  EXPECT_THROW(validate(look, 1), levelset::UsageError);
  look = {};
  look.background = V3d(0, 0, 2);
  EXPECT_THROW(validate(look, 1), levelset::UsageError);
  look = {};
  look.halo = 30;
  EXPECT_NO_THROW(validate(look, 4));
  EXPECT_THROW(validate(look, 5), levelset::UsageError);
  look = {};
  look.outline = 30;
  EXPECT_NO_THROW(validate(look, 4));
  EXPECT_THROW(validate(look, 5), levelset::UsageError);
  EffectOptions options;
  options.occlusion = 2;
  EXPECT_THROW(validate(options), levelset::UsageError);
  options = {};
  options.light = V3d(0);
  EXPECT_THROW(validate(options), levelset::UsageError);
  options = {};
  options.index = 0.5;
  EXPECT_THROW(validate(options), levelset::UsageError);
}

}  // namespace surface_effects_test
