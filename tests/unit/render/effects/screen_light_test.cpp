// Occlusion and shadows in the picture: closed forms, and traced light of the same scenes.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "levelset/csg/csg.h"
#include "levelset/shapes/shapes.h"
#include "render/cpu/cpu_renderer.h"
#include "render/effects/effects.h"
#include "render/effects/picture_view.h"
#include "render/embree/embree_renderer.h"
#include "tests/support/effect_pictures.h"
#include "tests/support/measured.h"
#include "tests/support/render_scenes.h"

namespace screen_light_test {

using Imath::V3d;
using support::onPlane;
using support::pictureOf;
using support::SurfacePoint;
using namespace render;

constexpr int kEdge = 128;

/// A floor y = 0 in front of a wall z = 0 of height 10, seen at 45 degrees, so that all of both is
/// seen.
Image floorAndWall() {
  Camera camera;
  camera.from = V3d(0, 50, 50);
  camera.to = V3d(0, 0, 0);
  camera.width = camera.height = kEdge;
  camera.orthoHeight = 64;
  return pictureOf(
      camera,
      [](const Camera::Ray& ray) -> std::optional<SurfacePoint> {
        if (const auto floor = onPlane(ray, V3d(0), V3d(0, 1, 0)); floor && floor->position.z > 0)
          return floor;
        const auto wall = onPlane(ray, V3d(0), V3d(0, 0, 1));
        return wall && wall->position.y < 10 ? wall : std::nullopt;
      },
      50);
}

TEST(ScreenLight, IsCompleteOnAPlane) {
  for (const double slope : {0.0, 1.0, 3.0}) {
    Camera camera;
    camera.from = V3d(0, 10, 40);
    camera.width = 64;
    camera.height = 48;
    const Image image = pictureOf(
        camera,
        [&](const Camera::Ray& ray) { return onPlane(ray, V3d(0), V3d(0, slope, 1).normalized()); },
        20);
    const PictureView view(image);
    for (const float open :
         occlusionLayer(view, {.radius = 5, .occluderDepth = 1}, CpuScreenRunner()))
      EXPECT_EQ(open, 1.0f) << slope;
    for (const float key :
         shadowLayer(view, {.toLight = V3d(0.2, 0.7, 0.7), .length = 20, .occluderDepth = 1},
                     CpuScreenRunner()))
      EXPECT_EQ(key, 1.0f) << slope;
  }
}

TEST(ScreenLight, OfTheSkyBesideAWallHasTheClosedForm) {
  const Image image = floorAndWall();
  const std::vector<float> open =
      occlusionLayer(PictureView(image), {.radius = 200, .occluderDepth = 100}, CpuScreenRunner());
  // A wall of height h and infinite length hides (1 − d / √(d² + h²)) / 2 of the sky at distance d.
  double squares = 0, worst = 0;
  int count = 0;
  for (int y = 0; y < kEdge; ++y) {
    const std::size_t i = static_cast<std::size_t>(y * kEdge + kEdge / 2);
    const double d = static_cast<double>(image.channels.at("P.Z")[i]),
                 top = static_cast<double>(image.channels.at("P.Y")[i]);
    if (!std::isfinite(image.channels.at("Z")[i]) || top > 1e-4 || d < 1 || d > 20) continue;
    const double exact = 1 - (1 - d / std::hypot(d, 10.0)) / 2;
    const double error = static_cast<double>(open[i]) - exact;
    squares += error * error;
    worst = std::max(worst, std::abs(error));
    ++count;
  }
  EXPECT_GT(count, 20);
  RecordProperty("rms", std::to_string(std::sqrt(squares / count)));
  EXPECT_LT(std::sqrt(squares / count), 0.04) << std::sqrt(squares / count);
  EXPECT_LT(worst, 0.1) << worst;
}

TEST(ScreenLight, OfALampEndsAtTheShadowOfAWall) {
  const Image image = floorAndWall();
  // The lamp is behind the wall, at an elevation of 45 degrees: the shadow is as long as the wall
  // is high.
  const double half = std::numbers::sqrt2 / 2;
  const V3d world(0, half, -half);
  const PictureView view(image);
  const V3d toLight(world.dot(view.right()), world.dot(view.up()), -world.dot(view.forward()));
  const std::vector<float> key =
      shadowLayer(view, {.toLight = toLight, .softness = 0.01, .length = 100, .occluderDepth = 100},
                  CpuScreenRunner());
  double length = 0;
  for (int y = 0; y < kEdge; ++y) {
    const std::size_t i = static_cast<std::size_t>(y * kEdge + kEdge / 2);
    if (image.channels.at("P.Y")[i] > 1e-4f || !std::isfinite(image.channels.at("Z")[i])) continue;
    const double d = static_cast<double>(image.channels.at("P.Z")[i]);
    if (key[i] < 0.5f) length = std::max(length, d);
  }
  const double pixel = 64.0 / kEdge * std::numbers::sqrt2;  // on the floor
  EXPECT_NEAR(length, 10, 3 * pixel);
}

/// Root mean square of the difference of two layers, over the pixels with a surface.
double rmsOf(const Image& image, const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!std::isfinite(image.channels.at("Z")[i])) continue;
    const double d = static_cast<double>(a[i]) - static_cast<double>(b[i]);
    sum += d * d;
    ++count;
  }
  return std::sqrt(sum / static_cast<double>(count));
}

struct Rms {
  double sky, key, none;  ///< `none`: of the sky, if nothing were hidden
};

/// Differences to traced light, with 256 rays to the sky and 64 to the lamp.
Rms beside(const Scene& scene) {
  RenderOptions options{.samples = 16, .ambientSamples = 16, .shadowSamples = 4};
  options.lightLayers = true;
  const Image traced = renderCpu(scene, options);
  const LookOptions look;
  EffectOptions effects;
  effects.occlusion = effects.shadow = 1;
  const Image screen = withEffects(traced, look, effects, CpuScreenRunner());
  const auto layer = [](const Image& image, const char* name) { return image.channels.at(name); };
  return {rmsOf(traced, layer(traced, "light.sky"), layer(screen, "light.sky")),
          rmsOf(traced, layer(traced, "light.key"), layer(screen, "light.key")),
          rmsOf(traced, layer(traced, "light.sky"), std::vector<float>(traced.pixelCount(), 1.0f))};
}

TEST(ScreenLight, IsCloseToTracedLight) {
  const auto ballOnPlate = levelset::unite(levelset::makeSphere(10, V3d(0, 10, 0), 0.5),
                                           levelset::makeBox(V3d(60, 4, 60), V3d(0, -2, 0), 0.5));
  const auto pot = levelset::subtract(levelset::makeCylinder(20, 30, V3d(0), V3d(0, 1, 0), 0.7),
                                      levelset::makeSphere(16, V3d(0, 15, 0), 0.7));
  const struct {
    const char* name;
    Scene scene;
    double sky, key, none;  // docs/effects.md has these figures
  } cases[] = {{"rings", support::sceneOf(support::rings()), 0.065, 0.087, 0.21},
               {"ball on a plate", support::sceneOf(ballOnPlate), 0.044, 0.064, 0.19},
               {"pot", support::sceneOf(pot), 0.015, 0.045, 0.014}};
  for (const auto& [name, scene, sky, key, none] : cases) {
    SCOPED_TRACE(name);
    const Rms found = beside(scene);
    EXPECT_LT(found.sky, support::measured(sky));
    EXPECT_LT(found.key, support::measured(key));
    EXPECT_NEAR(found.none, none, 0.1 * none);
  }
}

TEST(LightLayers, AgreeBetweenKernelAndJudge) {
  const Scene scene = support::sceneOf(support::rings());
  RenderOptions options{.samples = 4, .ambientSamples = 16, .shadowSamples = 4};
  options.lightLayers = true;
  const Image kernel = renderCpu(scene, options), judge = renderEmbree(scene, options);
  for (const char* name : {"light.sky", "light.key"}) {
    double worst = 0;
    std::size_t different = 0;
    for (std::size_t i = 0; i < kernel.pixelCount(); ++i) {
      const double d = std::abs(static_cast<double>(kernel.channels.at(name)[i]) -
                                static_cast<double>(judge.channels.at(name)[i]));
      worst = std::max(worst, d);
      different += d > 1e-3;
    }
    // A ray that grazes a surface may pass in one renderer only.
    EXPECT_LT(static_cast<double>(different) / static_cast<double>(kernel.pixelCount()), 0.01)
        << name << " " << different << " " << worst;
  }
}

TEST(LightLayers, DoNotChangeThePicture) {
  const Scene scene = support::sceneOf(support::rings());
  for (const Style style : {Style::Lit, Style::Tone}) {
    RenderOptions options{.samples = 1, .ambientSamples = 4, .shadowSamples = 2};
    options.style.style = style;
    const Image plain = renderCpu(scene, options);
    options.lightLayers = true;
    Image with = renderCpu(scene, options);
    EXPECT_EQ(with.channels.at("light.sky").size(), plain.pixelCount());
    with.channels.erase("light.sky");
    with.channels.erase("light.key");
    EXPECT_EQ(with.channels, plain.channels);
  }
}

}  // namespace screen_light_test
