// Checks that the colours of styles show the intended property.

#include "render/shading/style.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "render/cpu/cpu_renderer.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/images/compare_images.h"
#include "tests/support/measured.h"
#include "tests/support/render_scenes.h"

namespace style_test {

using Imath::C3f;
using Imath::V3d;
using namespace render;

CurvatureSample sampleOf(double k1, double k2) {
  return {(k1 + k2) / 2, k1 * k2, k1, k2};
}

TEST(Styles, ColourCurvaturesBySignAndSize) {
  const C3f flat = meanColour(sampleOf(0, 0), 1);
  for (const double size : {0.1, 1.0, 1e6}) {
    const C3f dome = meanColour(sampleOf(size, size), 1),
              bowl = meanColour(sampleOf(-size, -size), 1);
    EXPECT_GT(dome.x - dome.z, flat.x - flat.z);
    EXPECT_LT(bowl.x - bowl.z, flat.x - flat.z);
    const C3f saddle = gaussColour(sampleOf(size, -size), 1);
    EXPECT_GT(saddle.y - saddle.x, flat.y - flat.x);
  }
  EXPECT_EQ(gaussColour(sampleOf(5, 0), 1), flat);  // a cylinder has zero Gaussian curvature
  EXPECT_EQ(principalColour(sampleOf(0, 0), 1), flat);
  // Colours depend on the ratio of curvature to range.
  EXPECT_EQ(meanColour(sampleOf(3, 3), 3), meanColour(sampleOf(1, 1), 1));
}

TEST(Styles, DistinguishFiveKindsOfShape) {
  const C3f dome = principalColour(sampleOf(1, 1), 1), ridge = principalColour(sampleOf(1, 0), 1),
            saddle = principalColour(sampleOf(1, -1), 1),
            groove = principalColour(sampleOf(0, -1), 1),
            bowl = principalColour(sampleOf(-1, -1), 1);
  EXPECT_GT(dome.x, 2 * dome.y);       // red
  EXPECT_GT(ridge.y, 1.5f * ridge.z);  // yellow
  EXPECT_GT(saddle.y, saddle.x);       // green
  EXPECT_GT(groove.z, groove.x);       // cyan
  EXPECT_GT(groove.y, groove.x);
  EXPECT_GT(bowl.z, 2 * bowl.y);  // blue
}

TEST(Styles, DarkenPointsThatLargeBallsCannotTouch) {
  EXPECT_EQ(accessibilityOf(sampleOf(7, 0), 1), 1);
  EXPECT_GT(accessibilityOf(sampleOf(0, -0.1), 1), 0.9);
  EXPECT_LT(accessibilityOf(sampleOf(0, -100), 1), support::measured(1.21e-4));
  EXPECT_GT(accessibilityOf(sampleOf(0, -1), 1), accessibilityOf(sampleOf(0, -2), 1));
}

TEST(Styles, DrawSilhouettesOfUniformWidth) {
  for (const double radius : {1.0, 5.0, 40.0}) {
    const double width = 0.25;
    for (const double inside : {0.1, 0.2, 0.24, 0.26, 0.3, 0.5}) {
      const double place = (radius - inside) / radius;
      const double cosine = std::sqrt(1 - place * place);
      EXPECT_EQ(silhouetteOf(cosine, 1 / radius, width), inside < width ? 1 : 0) << inside;
    }
  }
  EXPECT_EQ(silhouetteOf(0.5, -1, 1), 0);  // curved towards the eye
  EXPECT_EQ(silhouetteOf(0.5, 0, 1), 0);
  EXPECT_EQ(silhouetteOf(1, 1e9, 1), 1);  // thinner than the line: entirely silhouette
}

TEST(Styles, ComputeTheCurvatureAlongTheView) {
  const double h = 0.05, radius = 1;
  const Scene scene = support::sceneOf(levelset::makeCylinder(radius, 8, V3d(0), V3d(0, 0, 1), h));
  const EmbreeScene rays(scene);
  for (const double slope : {0.0, 0.3, 1.0, 3.0}) {
    // The ray towards the side at (1, 0, 0) is increasingly axial. Its tangential part defines the
    // direction.
    const V3d target(radius, 0, 0.1), aside = V3d(0, 1, slope).normalized();
    const V3d direction = (V3d(-1, 0, 0) + aside).normalized();
    const Hit hit = rays.intersect(target - direction * 3.0, direction);
    ASSERT_TRUE(hit.found);
    EXPECT_NEAR(hit.viewCurvature, aside.y * aside.y / radius, support::measured(6.2e-4)) << slope;
  }
}

/// Orthographic view along z of a ball of radius 1, with pixels of 0.02.
Scene ballScene() {
  Scene scene = support::sceneOf(levelset::makeSphere(1, V3d(0), 0.05), 120, 120);
  scene.camera.from = V3d(0, 0, 5);
  scene.camera.to = V3d(0);
  scene.camera.orthoHeight = 2.4;
  return scene;
}

C3f pixelOf(const Image& image, int x, int y) {
  const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                 static_cast<std::size_t>(x);
  return {image.channels.at("R")[i], image.channels.at("G")[i], image.channels.at("B")[i]};
}

TEST(Styles, InkTheRimOfABallInTheRequestedWidth) {
  for (const double width : {2.0, 6.0}) {
    RenderOptions options = {.samples = 1};
    options.style.style = Style::Ink;
    options.style.curvatureRange = 100;
    options.style.lineWidth = width;
    const Image image = renderCpu(ballScene(), options);
    int dark = 0;
    for (int x = 0; x < 60; ++x)
      if (pixelOf(image, x, 60).x < 0.1f &&
          image.ids.at("id")[60 * 120 + static_cast<std::size_t>(x)])
        ++dark;
    EXPECT_NEAR(dark, width, support::rounding(6));
  }
}

TEST(Styles, ReflectionLinesLieAtEqualAngles) {
  const V3d up(0, 0, 1), side(0, 1, 0);
  constexpr int kLines = 12;
  for (int n = 0; n < 2 * kLines; ++n)
    for (const double height : {-0.9, 0.0, 0.6}) {
      const double angle = M_PI * n / kLines, r = std::sqrt(1 - height * height);
      // Zero is the direction up × side.
      const V3d direction(-r * std::cos(angle), r * std::sin(angle), height);
      EXPECT_EQ(reflectionLineAt(direction, up, side, kLines), n % 2 == 0 ? 1 : 0) << n;
    }
}

TEST(Styles, ReflectionLinesOnABallFollowFromItsNormal) {
  RenderOptions options = {.samples = 1};
  options.style.style = Style::ReflectionLines;
  options.style.reflectionLines = 8;
  const Image image = renderCpu(ballScene(), options);
  // At the pixel x, the normal of the ball has the angle asin(x) and the reflection twice that.
  int compared = 0;
  for (int x = 15; x < 105; ++x) {
    const double angle = 2 * std::asin((x + 0.5 - 60) * 0.02);
    const double wave = std::cos(8 * (M_PI - angle));
    if (std::abs(wave) < 0.5) continue;
    ++compared;
    EXPECT_EQ(pixelOf(image, x, 60).x > 0.3f, wave > 0) << x;
  }
  EXPECT_GT(compared, 40);
}

class MatcapFile {
 public:
  MatcapFile() {
    // Red increases to the right, green downwards.
    Image image(64, 64);
    for (const char* name : {"R", "G", "B"}) image.addChannel(name, 0.1f);
    for (std::size_t i = 0; i < image.pixelCount(); ++i) {
      image.channels["R"][i] = 0.5f * static_cast<float>(i % 64) / 63;
      const std::size_t row = i / 64;
      image.channels["G"][i] = 0.5f * static_cast<float>(row) / 63;
    }
    writeImage(path, image);
  }
  ~MatcapFile() { std::filesystem::remove(path); }
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / "levelsmith-matcap-test.png";
};

TEST(Styles, DrawTheMatcapOnABall) {
  const MatcapFile file;
  RenderOptions options = {.samples = 1};
  options.style.style = Style::Matcap;
  options.style.matcap = std::make_shared<const ColourImage>(readColourPng(file.path));
  const Image image = renderCpu(ballScene(), options);
  for (const int x : {20, 40, 60, 80, 100}) {
    for (const int y : {40, 60, 80}) {
      const double u = (x + 0.5 - 60) / 50, v = (y + 0.5 - 60) / 50;
      if (std::hypot(u, v) > 0.9) continue;
      const C3f colour = pixelOf(image, x, y);
      EXPECT_NEAR(colour.x, 0.5 * (0.5 + 0.49 * u), support::measured(0.0046)) << x << ' ' << y;
      EXPECT_NEAR(colour.y, 0.5 * (0.5 + 0.49 * v), support::measured(0.00438)) << x << ' ' << y;
    }
  }
}

TEST(Styles, RefuseInvalidPictures) {
  EXPECT_THROW((void)readColourPng("/nowhere/at/all.png"), levelset::IoError);
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / "levelsmith-style-test.png";
  std::ofstream(path) << "no picture";
  EXPECT_THROW((void)readColourPng(path), levelset::InvalidInput);
  {
    const MatcapFile file;
    std::ifstream whole(file.path, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(whole), {}};
    std::ofstream(path, std::ios::binary) << bytes.substr(0, bytes.size() / 2);
  }
  EXPECT_THROW((void)readColourPng(path), levelset::InvalidInput);
  std::filesystem::remove(path);
  RenderOptions options;
  options.style.style = Style::Matcap;
  EXPECT_THROW((void)renderCpu(ballScene(), options), levelset::UsageError);
  options.style = {.curvatureRange = -1};
  EXPECT_THROW((void)renderCpu(ballScene(), options), levelset::UsageError);
}

TEST(Styles, WithoutLightNeedNoLayers) {
  const Scene scene = support::sceneOf(support::rings(), 80, 60);
  for (const Style style : {Style::Tone, Style::Ink, Style::Lit}) {
    RenderOptions options{.samples = 2, .ambientSamples = 2, .style = {.style = style}};
    const Image all = renderCpu(scene, options);
    options.layers = false;
    const Image colours = renderCpu(scene, options);
    for (const char* channel : {"R", "G", "B", "A"})
      EXPECT_EQ(colours.channels.at(channel), all.channels.at(channel));
    EXPECT_EQ(colours.channels.at("N.X") == all.channels.at("N.X"), style == Style::Lit);
  }
}

TEST(Styles, AgreeOnGpuAndProcessor) {
  const MatcapFile file;
  for (const Style style : kStyles) {
    RenderOptions options = {.samples = 2, .ambientSamples = 2, .shadowSamples = 1};
    options.style.style = style;
    if (style == Style::Matcap)
      options.style.matcap = std::make_shared<const ColourImage>(readColourPng(file.path));
    const Scene scene = support::sceneOf(support::rings(), 64, 48);
    const Image gpu = renderGpu(scene, options), cpu = renderCpu(scene, options);
    EXPECT_TRUE(compareImages(gpu, cpu, {.exact = true}).agrees()) << styleName(style);
    EXPECT_EQ(cpu.attributes.at("ls:style"), styleName(style));
  }
}

}  // namespace style_test
