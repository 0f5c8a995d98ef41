// Pictures for two eyes: parallax in closed form, and pairs from depth beside drawn ones.

#include "render/effects/stereo.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "levelset/error.h"
#include "render/cpu/cpu_renderer.h"
#include "render/effects/picture_view.h"
#include "tests/support/effect_pictures.h"
#include "tests/support/render_scenes.h"

namespace stereo_test {

using Imath::V3d;
using support::onPlane;
using support::pictureOf;
using namespace render;

constexpr double kDepth = 20;

Camera frontCamera() {
  Camera camera;
  camera.from = V3d(0, 0, kDepth);
  camera.width = 64;
  camera.height = 48;
  return camera;
}

/// A plane across the view with a ramp of red from left to right.
Image rampPicture() {
  Image image = pictureOf(
      frontCamera(), [](const Camera::Ray& ray) { return onPlane(ray, V3d(0), V3d(0, 0, 1)); }, 20);
  for (std::size_t i = 0; i < image.pixelCount(); ++i)
    image.channels["R"][i] = static_cast<float>(i % 64);
  return image;
}

TEST(StereoPair, OfAPlaneIsShiftedByTheParallax) {
  const Image image = rampPicture();
  const double step = PictureView(image).stepX();
  const double eye = 0.5;
  for (const double screen : {kDepth, 10.0, 40.0}) {
    const Image moved = seenFromBeside(image, eye, screen);
    const double parallax = eye * (1 / kDepth - 1 / screen) / step;
    for (int x = 12; x < 52; ++x)
      EXPECT_NEAR(moved.channels.at("R")[static_cast<std::size_t>(64 * 20 + x)], x + parallax, 2e-4)
          << screen;
  }
}

TEST(StereoPair, IsThePictureItselfWithoutADistance) {
  const Image image = rampPicture();
  const Image moved = seenFromBeside(image, 0, 10);
  EXPECT_EQ(moved.channels.at("R"), image.channels.at("R"));
}

TEST(StereoPair, HasNoHolesAndShowsNearerSurfacesInFront) {
  // A near plate in front of a far wall.
  Image image = pictureOf(
      frontCamera(),
      [](const Camera::Ray& ray) {
        const auto plate = onPlane(ray, V3d(0, 0, 8), V3d(0, 0, 1));
        return std::abs(plate->position.x) < 1.5 ? plate : onPlane(ray, V3d(0), V3d(0, 0, 1));
      },
      20);
  for (std::size_t i = 0; i < image.pixelCount(); ++i)
    image.channels["G"][i] = image.channels["Z"][i] < 15 ? 1.0f : 0.25f;
  const Image moved = seenFromBeside(image, 1, kDepth);
  std::size_t plate = 0, shown = 0;
  for (std::size_t i = 0; i < image.pixelCount(); ++i) {
    EXPECT_EQ(moved.channels.at("A")[i], 1.0f);
    const float green = moved.channels.at("G")[i];
    EXPECT_GE(green, 0.25f);
    plate += image.channels.at("G")[i] > 0.6f;
    shown += green > 0.6f;
  }
  EXPECT_NEAR(static_cast<double>(shown), static_cast<double>(plate), 1.01 * 48);
}

/// Replaces the colours by a function of the position, without the noise of random samples.
Image paintedByPosition(Image image) {
  for (std::size_t i = 0; i < image.pixelCount(); ++i) {
    const bool isHit = std::isfinite(image.channels["Z"][i]);
    image.channels["A"][i] = isHit ? 1.0f : 0.0f;
    for (const auto& [colour, axis] : {std::pair("R", "P.X"), {"G", "P.Y"}, {"B", "P.Z"}})
      image.channels[colour][i] = isHit ? 0.5f + 0.5f * std::sin(image.channels[axis][i]) : 0.0f;
  }
  return image;
}

TEST(StereoPair, AgreesWithADrawnOne) {
  Scene scene = support::sceneOf(support::rings());
  const RenderOptions options{.samples = 1, .ambientSamples = 0, .shadowSamples = 0};
  const Image middle = paintedByPosition(renderCpu(scene, options));
  const PictureView view(middle);
  const double eye = view.depthRange().x / 60;
  // A parallel camera: its picture is that of an infinitely distant screen.
  const V3d step = view.right() * eye;
  scene.camera.from += step;
  scene.camera.to += step;
  const Image drawn = paintedByPosition(renderCpu(scene, options));
  const auto differenceTo = [&](const Image& image) {
    double squares = 0;
    for (const char* name : {"R", "G", "B", "A"})
      for (std::size_t i = 0; i < drawn.pixelCount(); ++i)
        squares += std::pow(static_cast<double>(image.channels.at(name)[i]) -
                                static_cast<double>(drawn.channels.at(name)[i]),
                            2);
    return std::sqrt(squares);
  };
  // 0.23 of the difference is left, by gaps and interpolation. To the wrong side it grows to 1.21.
  const double before = differenceTo(middle);
  EXPECT_LT(differenceTo(seenFromBeside(middle, eye, 1e9)) / before, 0.35);
  EXPECT_GT(differenceTo(seenFromBeside(middle, -eye, 1e9)) / before, 1.1);
}

TEST(StereoPair, OfReducedPicturesIsThatOfReducedEyes) {
  const Image image = rampPicture();
  const auto eye = [&](double shift) {
    return reducedPicture(seenFromBeside(image, shift, 10), 2);
  };
  EXPECT_EQ(stereoOf(image, Stereo::Anaglyph, 1, 10, 2).channels,
            stereoPicture(eye(-0.5), eye(0.5), Stereo::Anaglyph).channels);
}

TEST(StereoPair, IsRefusedForOrthographicPicturesAndOtherSizes) {
  const Image straight = pictureOf(
      support::straightCamera(8, 8),
      [](const Camera::Ray& ray) { return onPlane(ray, V3d(0), V3d(0, 0, 1)); }, 10);
  EXPECT_THROW((void)stereoOf(straight, Stereo::Anaglyph, 0, 0), levelset::InvalidInput);
  EXPECT_THROW((void)stereoPicture(straight, rampPicture(), Stereo::SideBySide),
               levelset::InvalidInput);
}

TEST(StereoPair, PutsTheEyesInTheirPlaces) {
  Image left = rampPicture(), right = left;
  left.addChannel("R", 0.1f);
  right.addChannel("R", 0.4f);
  const Image beside = stereoPicture(left, right, Stereo::SideBySide);
  EXPECT_EQ(beside.width, 128);
  EXPECT_EQ(beside.channels.at("R")[3], 0.1f);
  EXPECT_EQ(beside.channels.at("R")[64 + 3], 0.4f);
  EXPECT_EQ(stereoPicture(left, right, Stereo::CrossEyed).channels.at("R")[3], 0.4f);
  // Red is the brightness of the left eye. Green and blue are those of the right eye.
  right.addChannel("G", 0.2f);
  right.addChannel("B", 0.3f);
  const auto shown = [](const Image& image, const char* channel) {
    return displayOfLinear(static_cast<double>(image.channels.at(channel)[3]));
  };
  const auto brightness = [&](const Image& eye) {
    return 0.299 * shown(eye, "R") + 0.587 * shown(eye, "G") + 0.114 * shown(eye, "B");
  };
  const Image glasses = stereoPicture(left, right, Stereo::Anaglyph),
              exchanged = stereoPicture(right, left, Stereo::Anaglyph);
  EXPECT_NEAR(shown(glasses, "R"), brightness(left), 1e-6);
  EXPECT_NEAR(shown(glasses, "G"), shown(right, "G"), 1e-6);
  EXPECT_NEAR(shown(glasses, "B"), shown(right, "B"), 1e-6);
  EXPECT_NEAR(shown(exchanged, "R"), brightness(right), 1e-6);
  EXPECT_GT(std::abs(shown(exchanged, "R") - shown(glasses, "R")), 0.02);
  EXPECT_GT(std::abs(shown(exchanged, "G") - shown(glasses, "G")), 0.1);
}

}  // namespace stereo_test
