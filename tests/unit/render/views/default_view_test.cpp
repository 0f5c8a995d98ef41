#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "levelset/meshing/band_to_mesh.h"
#include "levelset/shapes/shapes.h"
#include "render/cpu/cpu_renderer.h"
#include "render/embree/embree_renderer.h"
#include "render/scene/scene.h"
#include "render/shading/shading.h"
#include "tests/support/measured.h"
#include "tests/support/render_scenes.h"

/// The default camera and the ground of a scene.
namespace {

using Imath::V3d;
using render::Image;
using render::Scene;

const render::RenderOptions kDataOnly = {.samples = 1, .ambientSamples = 0, .shadowSamples = 0};
constexpr double kFov = 0.6;

/// Box of the pixels that show a surface; the upper ends are exclusive.
struct Seen {
  int left = 1 << 20, right = 0, top = 1 << 20, bottom = 0;
};

Seen seenIn(const Image& image) {
  Seen seen;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      if (image.ids.at("id")[static_cast<std::size_t>(y * image.width + x)] == 0) continue;
      seen.left = std::min(seen.left, x);
      seen.right = std::max(seen.right, x + 1);
      seen.top = std::min(seen.top, y);
      seen.bottom = std::max(seen.bottom, y + 1);
    }
  return seen;
}

Scene sceneWith(const levelset::NarrowBand& band) {
  Scene scene;
  scene.solids.push_back({.band = band});
  return scene;
}

/// The mesh of a solid, as a scene of its own.
Scene sceneWithMesh(const levelset::NarrowBand& band) {
  Scene scene;
  scene.meshes.push_back({std::make_shared<const levelset::TriMesh>(levelset::bandToMesh(band))});
  return scene;
}

TEST(DefaultCamera, FitsTheSurfacesToTheFrame) {
  // A ball, a rod across the diagonal of its box, and a rod along the view. The box of the rods
  // projects to a much larger area than the rods.
  const levelset::NarrowBand solids[] = {
      levelset::makeSphere(12, V3d(5, -3, 2), 1),
      levelset::makeCapsule(V3d(-30, -25, -30), V3d(30, 25, 30), 3, 1),
      levelset::makeCapsule(V3d(-18, -14, -40), V3d(18, 14, 40), 3, 1)};
  for (const auto& band : solids)
    for (const V3d& up : {V3d(0, 1, 0), V3d(0, 0, 1)})
      for (const auto& [width, height] : {std::pair{320, 240}, {160, 300}})
        for (Scene scene : {sceneWith(band), sceneWithMesh(band)}) {
          scene.camera = framingCamera(scene, width, height, kFov, up);
          const Seen seen = seenIn(renderCpu(scene, kDataOnly));
          EXPECT_NEAR(seen.left, width - seen.right, 2);
          EXPECT_NEAR(seen.top, height - seen.bottom, 2);
          const double filled = std::max(static_cast<double>(seen.right - seen.left) / width,
                                         static_cast<double>(seen.bottom - seen.top) / height);
          EXPECT_NEAR(filled, 0.94, 0.015);
        }
}

TEST(DefaultCamera, FitsTheResultOfAnExpression) {
  Scene scene;
  scene.solids.push_back({.band = levelset::makeSphere(10, V3d(0), 1), .name = "a"});
  scene.solids.push_back(
      {.band = levelset::makeSphere(40, V3d(45, 0, 0), 1), .id = 2, .name = "b"});
  scene.csg = render::CsgExpression("a - b", {"a", "b"});
  scene.camera = framingCamera(scene, 200, 200, kFov, V3d(0, 1, 0));
  const Seen seen = seenIn(renderCpu(scene, kDataOnly));
  EXPECT_GT(seen.bottom - seen.top, 0.65 * 200);
  EXPECT_GE(seen.left, 0.03 * 200 - 1);
  EXPECT_LE(seen.right, 0.97 * 200 + 1);
}

TEST(DefaultCamera, RefusesASceneWithoutASurface) {
  EXPECT_THROW((void)framingCamera(Scene(), 10, 10, kFov, V3d(0, 1, 0)), levelset::UsageError);
}

TEST(Extents, AreThoseOfTheZeroSet) {
  const double radius = 12;
  const V3d centre(5.3, -3.1, 2.2);
  const levelset::NarrowBand ball = levelset::makeSphere(radius, centre, 1);
  for (const V3d& d : {V3d(1, 0, 0), V3d(1, 2, -3), V3d(-0.2, 0.1, 0.5)})
    EXPECT_NEAR(ball.zeroSetExtents({d})[0], centre.dot(d) + radius * d.length(),
                support::measured(0.0179) * d.length());
  EXPECT_EQ(levelset::NarrowBand().zeroSetExtents({V3d(1)})[0],
            -std::numeric_limits<double>::infinity());
}

TEST(Ground, ShowsTheShadowOfABall) {
  // With light of one direction, a point of the ground is dark if the ray towards the light passes
  // the ball's centre within its radius.
  const double radius = 10;
  for (const V3d& up : {V3d(0, 1, 0), V3d(0, 0, 1)}) {
    Scene scene = sceneWith(levelset::makeSphere(radius, V3d(3, 2, 1), 0.5));
    scene.camera = framingCamera(scene, 240, 180, kFov, up);
    scene.camera.from += (scene.camera.from - scene.camera.to) * 2.0;
    scene.key.softness = 0;
    scene.ambient = 0;
    scene.ground = groundOf(scene, up);
    const V3d light = keyDirection(scene);
    ASSERT_GT(light.dot(up), 0.2);
    EXPECT_NEAR(scene.ground->point.dot(up), V3d(3, 2, 1).dot(up) - radius,
                support::measured(0.0079));
    const render::RenderOptions options = {.samples = 1, .ambientSamples = 0, .shadowSamples = 1};
    for (const bool isJudge : {false, true}) {
      const Image image = isJudge ? renderEmbree(scene, options) : renderCpu(scene, options);
      int dark = 0, wrong = 0;
      for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
          const auto i = static_cast<std::size_t>(y * image.width + x);
          if (image.ids.at("id")[i] != 0) continue;
          const render::Camera::Ray ray = scene.camera.ray(x + 0.5, y + 0.5);
          const double t = (ray.origin - scene.ground->point).dot(up) / -ray.direction.dot(up);
          const V3d toCentre = V3d(3, 2, 1) - (ray.origin + ray.direction * t);
          const bool isDark = t > 0 && toCentre.cross(light).length() < radius;
          dark += isDark ? 1 : 0;
          wrong += isDark != (image.channels.at("A")[i] > 0.5f) ? 1 : 0;
          EXPECT_EQ(image.channels.at("R")[i] > 0 && image.channels.at("A")[i] == 0, false);
          EXPECT_TRUE(std::isinf(image.channels.at("Z")[i])) << "the ground is in no other layer";
        }
      EXPECT_GT(dark, 400);
      // Pixels at the edge of the shadow, whose sample is on the other side of it.
      EXPECT_LE(wrong, support::measured(39));
    }
  }
}

TEST(Ground, IsTransparentWhereLightReachesIt) {
  Scene scene = support::sceneOf(levelset::makeSphere(10, V3d(0), 1), 120, 90);
  const auto darkest = [&](const V3d& up) {
    scene.ground = groundOf(scene, up);
    scene.camera.up = up;
    const Image image = renderCpu(scene);
    float most = 0, nearest = 1;
    for (std::size_t i = 0; i < image.pixelCount(); ++i)
      if (image.ids.at("id")[i] == 0) {
        most = std::max(most, image.channels.at("A")[i]);
        nearest = std::min(nearest, image.channels.at("A")[i]);
      }
    EXPECT_GE(nearest, 0.0f);
    return most;
  };
  EXPECT_GT(darkest(V3d(0, 1, 0)), 0.5f);
  scene.solids[0].opacity = 0.5;
  EXPECT_GT(darkest(V3d(0, 1, 0)), 0.2f);
}

}  // namespace
