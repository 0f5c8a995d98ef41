// Surfaces before the near plane or beyond the far plane are invisible. Tested with exact shapes,
// shadow casters, and the renderers against each other.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>

#include "levelset/shapes/shapes.h"
#include "render/cpu/cpu_renderer.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/images/compare_images.h"
#include "tests/support/measured.h"
#include "tests/support/render_scenes.h"

namespace depth_range_test {

using Imath::V3d;
using namespace render;

const RenderOptions kData = {
    .samples = 1, .ambientSamples = 0, .shadowSamples = 0, .thickness = true};
constexpr double kRadius = 20, kAway = 100, kHeight = 50;

/// A ball seen along −z from kAway.
Scene ballScene(double near, std::optional<double> far) {
  Scene scene = support::sceneOf(levelset::makeSphere(kRadius, V3d(0), 0.5));
  scene.solids[0].name = "a";
  scene.camera.from = V3d(0, 0, kAway);
  scene.camera.to = V3d(0);
  scene.camera.orthoHeight = kHeight;
  scene.camera.near = near;
  scene.camera.far = far;
  return scene;
}

/// Calls judge(pixel, r²) with the squared distance from the axis, for pixels off the ball's
/// outline.
void forEachPixel(const Image& image, const std::function<void(std::size_t, double)>& judge) {
  const double pixel = kHeight / image.height;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const double r2 =
          (std::pow(x + 0.5 - 0.5 * image.width, 2) + std::pow(y + 0.5 - 0.5 * image.height, 2)) *
          pixel * pixel;
      if (std::abs(r2 - kRadius * kRadius) < 20) continue;
      judge(static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                static_cast<std::size_t>(x),
            r2);
    }
}

double at(const Image& image, const char* channel, std::size_t i) {
  return static_cast<double>(image.channels.at(channel)[i]);
}

TEST(DepthRange, CutsABallAtItsPlanes) {
  struct Range {
    double near;
    std::optional<double> far;
  };
  for (const auto& [near, far] :
       {Range{0, {}}, {90, {}}, {100, {}}, {0, 90}, {88, 112}, {97, 103}, {121, {}}, {0, 79}}) {
    const Scene scene = ballScene(near, far);
    for (const Image& image : {renderCpu(scene, kData), renderEmbree(scene, kData)})
      forEachPixel(image, [&](std::size_t i, double r2) {
        const double half = r2 < kRadius * kRadius ? std::sqrt(kRadius * kRadius - r2) : 0;
        const double in = kAway - half, out = kAway + half, end = far.value_or(1e9);
        for (const double place : {in, out})
          if (std::abs(place - near) < 0.2 || std::abs(place - end) < 0.2) return;
        const bool hits = half > 0, seesFront = hits && in > near && in < end,
                   seesBack = hits && in < near && out > near && out < end;
        const double thickness = std::max(0.0, std::min(out, end) - std::max(in, near));
        ASSERT_NEAR(at(image, "thickness", i), thickness, support::measured(0.0229))
            << near << ' ' << r2;
        ASSERT_EQ(std::isfinite(at(image, "Z", i)), seesFront || seesBack) << near << ' ' << r2;
        if (!seesFront && !seesBack) return;
        ASSERT_NEAR(at(image, "Z", i), seesFront ? in : out, support::measured(0.0115));
        // The normal points outwards, also from inside.
        ASSERT_NEAR(at(image, "N.Z", i), (seesFront ? half : -half) / kRadius,
                    support::measured(5.33e-4));
      });
  }
}

/// Expects that all renderers draw the scene alike.
void expectAlike(const Scene& scene, const std::string& what, Filter filter = Filter::Trilinear) {
  RenderOptions data = kData, lit = {.samples = 2, .ambientSamples = 2, .shadowSamples = 1};
  data.filter = lit.filter = filter;
  const Image cpu = renderCpu(scene, data), judge = renderEmbree(scene, data);
  const ImageComparison found = compareImages(cpu, judge);
  EXPECT_GT(found.bothHit, cpu.pixelCount() / 80) << what;
  EXPECT_TRUE(found.agrees()) << what << ": " << found.reason();
  for (std::size_t i = 0; i < cpu.pixelCount(); ++i) {
    if (!std::isfinite(at(cpu, "Z", i))) continue;
    ASSERT_GE(at(cpu, "Z", i), scene.camera.near * (1 - 1e-6)) << what;
    ASSERT_LE(at(cpu, "Z", i), scene.camera.farthest() * (1 + 1e-6)) << what;
  }
  EXPECT_EQ(
      compareImages(renderCpu(scene, lit), renderGpu(scene, lit), {.exact = true}).differentBits,
      0u)
      << what;
}

TEST(DepthRange, AgreesOnAllRenderers) {
  for (const bool isOrtho : {false, true}) {
    Scene scene = support::sceneOf(support::rings());
    const double away = (scene.camera.to - scene.camera.from).length();
    if (isOrtho) scene.camera.orthoHeight = 90;
    for (const auto& [near, far] : {std::pair{0.9, 2.0}, {1.0, 1.2}, {0.0, 1.0}, {0.8, 0.95}}) {
      scene.camera.near = near * away;
      scene.camera.far = far * away;
      expectAlike(scene, std::to_string(near));
    }
  }
}

TEST(DepthRange, AgreesForCsgAndSplines) {
  Scene scene = support::sceneOf(levelset::makeSphere(20, V3d(0.1, 0.2, 0.3), 1));
  scene.solids.push_back({.band = levelset::makeBox(V3d(24), V3d(8.1, 6.3, 9.2), 0.61), .id = 2});
  const double away = (scene.camera.to - scene.camera.from).length();
  for (const char* csg : {"a | b", "a & b", "a - b", "b - a"}) {
    scene.csg = CsgExpression(csg, {"a", "b"});
    scene.camera.near = 0.9 * away;
    scene.camera.far = 1.1 * away;
    expectAlike(scene, csg);
  }
  scene.csg = CsgExpression("a - b", {"a", "b"});
  expectAlike(scene, "spline", Filter::BSplineQi);
}

TEST(DepthRange, CutsMeshesBesideSolids) {
  const auto sheet = [](double z) {
    levelset::TriMesh mesh;
    mesh.positions = {{-30, -25, z}, {30, -25, z}, {30, 25, z}, {-30, 25, z}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return std::make_shared<const levelset::TriMesh>(mesh);
  };
  Scene scene = ballScene(0, {});
  scene.meshes.push_back({sheet(30), {}, 2, "front"});
  scene.meshes.push_back({sheet(-30), {}, 3, "back"});
  const auto idOfMiddle = [&](double near, std::optional<double> far, double& z) {
    scene.camera.near = near;
    scene.camera.far = far;
    const Image cpu = renderCpu(scene, kData), judge = renderEmbree(scene, kData);
    EXPECT_TRUE(compareImages(cpu, judge).agrees());
    const std::size_t middle = cpu.pixelCount() / 2 + static_cast<std::size_t>(cpu.width / 2);
    z = at(cpu, "Z", middle);
    return cpu.ids.at("id")[middle];
  };
  double z;
  EXPECT_EQ(idOfMiddle(0, {}, z), 2u);
  EXPECT_NEAR(z, 70, support::rounding(80));
  EXPECT_EQ(idOfMiddle(75, {}, z), 1u);
  EXPECT_EQ(idOfMiddle(100, {}, z), 1u);
  EXPECT_EQ(idOfMiddle(125, {}, z), 3u);
  EXPECT_NEAR(z, 130, support::rounding(150));
  EXPECT_EQ(idOfMiddle(125, 129, z), 0u);
}

TEST(DepthRange, DoesNotChangeShadows) {
  // A roof before the near plane, between the ball and the light.
  const auto brightness = [](bool hasRoof, bool isJudge) {
    Scene scene = ballScene(79, {});
    scene.camera.to = V3d(0, 0, 0);
    if (hasRoof)
      scene.solids.push_back(
          {.band = levelset::makeBox(V3d(80, 80, 4), V3d(0, 30, 50), 1), .id = 2});
    const RenderOptions options = {.samples = 1, .ambientSamples = 0, .shadowSamples = 4};
    const Image image = isJudge ? renderEmbree(scene, options) : renderCpu(scene, options);
    double sum = 0;
    for (std::size_t i = 0; i < image.pixelCount(); ++i) {
      EXPECT_NE(image.ids.at("id")[i], 2u);
      sum += at(image, "G", i);
    }
    return sum;
  };
  for (const bool isJudge : {false, true})
    EXPECT_LT(brightness(true, isJudge), 0.8 * brightness(false, isJudge));
}

TEST(DepthRange, IsStoredInThePictureHeader) {
  const Image whole = renderCpu(ballScene(0, {}), kData),
              cut = renderCpu(ballScene(90, 112.5), kData);
  EXPECT_FALSE(whole.attributes.contains("ls:near") || whole.attributes.contains("ls:far"));
  EXPECT_EQ(cut.attributes.at("ls:near"), "90");
  EXPECT_EQ(cut.attributes.at("ls:far"), "112.5");
}

}  // namespace depth_range_test
