// Pictures of Bézier volumes: both renderers, shadows, other parts in the scene, and scene files.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "render/cpu/cpu_renderer.h"
#include "render/cpu/cpu_tracer.h"
#include "render/embree/embree_renderer.h"
#include "render/images/compare_images.h"
#include "render/kernel/kernel_scene.h"
#include "render/quadrics/quadric_part.h"
#include "render/views/picture.h"
#include "render/views/scene_file.h"
#include "tests/support/bezier_scenes.h"
#include "tests/support/files.h"

namespace bezier_scene_test {

using Imath::V3d;
using namespace render;

const RenderOptions kPlain{.samples = 1, .ambientSamples = 0, .shadowSamples = 0};

Scene sceneOf(const BezierVolume& volume) {
  Scene scene;
  scene.beziers.push_back({.caster = BezierCaster(volume), .id = 5, .name = "bezier"});
  scene.camera = {.from = {0.4, 1.5, 4.5}, .to = {0.2, 0, 0}, .width = 32, .height = 24};
  return scene;
}

std::set<std::uint32_t> idsOf(const Image& image) {
  const std::vector<std::uint32_t>& ids = image.ids.at("id");
  return {ids.begin(), ids.end()};
}

TEST(BezierScene, HasThePictureOfTheJudge) {
  for (const BezierVolume& volume :
       {bezier_scenes::sphere(3), bezier_scenes::folded(), bezier_scenes::dice()}) {
    const Scene scene = sceneOf(volume);
    const Image image = renderCpu(scene, kPlain);
    const ImageComparison found = compareImages(image, renderEmbree(scene, kPlain));
    EXPECT_TRUE(found.agrees()) << found.reason();
    EXPECT_GT(found.bothHit, 20U);
    EXPECT_EQ(idsOf(image), (std::set<std::uint32_t>{0, 5}));
  }
}

TEST(BezierScene, StandsBesideSolids) {
  Scene scene = sceneOf(bezier_scenes::sphere(2));
  scene.solids.push_back({.band = levelset::makeSphere(0.6, V3d(1, 0, 0), 0.1), .id = 8});
  const Image image = renderCpu(scene, kPlain);
  EXPECT_EQ(idsOf(image), (std::set<std::uint32_t>{0, 5, 8}));
  const ImageComparison found = compareImages(image, renderEmbree(scene, kPlain));
  EXPECT_TRUE(found.agrees()) << found.reason();
  // The nearer of the two balls is seen.
  const auto toBall = [](const Camera::Ray& ray, const V3d& centre, double radius) {
    const V3d from = ray.origin - centre;
    const double b = from.dot(ray.direction), d = b * b - from.length2() + radius * radius;
    return d > 0 ? -b - std::sqrt(d) : 1e9;
  };
  std::size_t pixel = 0;
  for (int y = 0; y < 24; ++y)
    for (int x = 0; x < 32; ++x, ++pixel) {
      const Camera::Ray ray = scene.camera.ray(x + 0.5, y + 0.5);
      const double a = toBall(ray, V3d(0), 1), b = toBall(ray, V3d(1, 0, 0), 0.6);
      if (std::abs(a - b) > 0.02) {
        EXPECT_EQ(image.ids.at("id")[pixel], a < b ? 5U : 8U);
      }
    }
}

TEST(BezierScene, BlocksLight) {
  const Scene scene = sceneOf(bezier_scenes::sphere(4));
  const KernelScene surfaces(scene, RenderOptions{});
  bezier_scenes::Numbers numbers(3);
  std::vector<LightRay> rays;
  std::vector<bool> blocked;
  while (rays.size() < 300) {
    const V3d from(2 * numbers(), 2 * numbers(), 2 * numbers()),
        along(numbers(), numbers(), numbers());
    const double length = 2 + numbers();
    const V3d unit = along.normalized();
    const double b = from.dot(unit), c = from.length2() - 1, d = b * b - c;
    const auto isOn = [&](double t) { return t > 0 && t < length; };
    rays.push_back({from, unit, length, 1});
    blocked.push_back(d > 0 && (isOn(-b - std::sqrt(d)) || isOn(-b + std::sqrt(d))));
  }
  const std::vector<double> light = surfaces.transmittances(CpuTracer(), rays);
  const EmbreeScene judge(scene);
  for (std::size_t n = 0; n < rays.size(); ++n) {
    EXPECT_EQ(light[n], blocked[n] ? 0 : 1);
    EXPECT_EQ(judge.isOccluded(rays[n].origin, rays[n].direction, 0, rays[n].maxDistance),
              blocked[n]);
  }
  EXPECT_GT(std::count(blocked.begin(), blocked.end(), true), 30);
}

/// A ball of opacity 0.3 has two surfaces along a ray, and a point in it is lit through one.
TEST(BezierScene, TransparentBallsLetLightThroughEachSurface) {
  Scene scene = sceneOf(bezier_scenes::sphere(3));
  scene.beziers[0].opacity = 0.3;
  EXPECT_FALSE(scene.isOpaque());
  for (const Image& image : {renderCpu(scene, kPlain), renderEmbree(scene, kPlain)}) {
    const std::vector<float>& alpha = image.channels.at("A");
    std::size_t full = 0;
    for (const float a : alpha) {
      if (a == 0) continue;
      EXPECT_NEAR(a, 1 - 0.7 * 0.7, 1e-6);
      ++full;
    }
    EXPECT_GT(full, 50U);
  }
  const KernelScene surfaces(scene, RenderOptions{});
  const EmbreeScene judge(scene);
  const V3d along = V3d(1, 2, 3).normalized();
  const std::vector<LightRay> rays{{V3d(0), along, 10, 1},
                                   {V3d(0), along, 0.5, 1},
                                   {along * -3, along, 10, 1},
                                   {along * 3, along, 10, 1}};
  const std::vector<double> light = surfaces.transmittances(CpuTracer(), rays);
  const double exact[] = {0.7, 1, 0.49, 1};
  for (std::size_t n = 0; n < rays.size(); ++n) {
    EXPECT_NEAR(light[n], exact[n], 1e-15);
    EXPECT_NEAR(judge.transmittance(rays[n].origin, rays[n].direction, rays[n].maxDistance),
                exact[n], 1e-15);
  }
}

/// Transparent parts of all kinds behind and in each other have the colours of the judge.
TEST(BezierScene, TransparentPartsMixInTheOrderOfTheirDepths) {
  Scene scene = sceneOf(bezier_scenes::dice());
  scene.beziers[0].opacity = 0.4;
  scene.beziers.push_back({.caster = BezierCaster(bezier_scenes::sphere(2)),
                           .colour = {0.1f, 0.5f, 0.2f},
                           .id = 6,
                           .opacity = 0.2});
  scene.beziers.push_back({.caster = BezierCaster(bezier_scenes::trimmedSurface()),
                           .colour = {0.8f, 0.1f, 0.1f},
                           .id = 7});
  scene.solids.push_back({.band = levelset::makeSphere(0.6, V3d(1, 0, 0), 0.1),
                          .colour = {0.2f, 0.2f, 0.9f},
                          .id = 8,
                          .opacity = 0.5});
  levelset::TriMesh sheet;
  sheet.positions = {{-1, -1, 0.7}, {1.5, -1, 0.7}, {1.5, 1, 0.9}, {-1, 1, 0.9}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.meshes.push_back({.mesh = std::make_shared<const levelset::TriMesh>(std::move(sheet)),
                          .id = 9,
                          .opacity = 0.25});
  // Opaque balls before, inside and behind the transparent parts.
  scene.quadrics.push_back(
      makeQuadricPart({{V3d(1.6, 0.6, 1.2), 0.2f, packedColour({0.9f, 0.8f, 0})},
                       {V3d(0, 0, 0), 0.35f, packedColour({0, 0.8f, 0.8f})},
                       {V3d(-1.2, -0.8, -0.6), 0.4f, packedColour({0.5f, 0, 0.5f})}},
                      {}));
  scene.quadrics.back().id = 10;
  const Image image = renderCpu(scene, kPlain), judged = renderEmbree(scene, kPlain);
  const std::vector<std::uint32_t>& ids = image.ids.at("id");
  EXPECT_GT(std::count(ids.begin(), ids.end(), 10U), 2);
  for (const char* channel : {"R", "G", "B", "A"}) {
    const std::vector<float>&a = image.channels.at(channel), &b = judged.channels.at(channel);
    float most = 0;
    for (std::size_t n = 0; n < a.size(); ++n) most = std::max(most, std::abs(a[n] - b[n]));
    EXPECT_LT(most, 2e-5f) << channel;
  }
  const ImageComparison found = compareImages(image, judged);
  EXPECT_TRUE(found.agrees()) << found.reason();
  // Several transparent surfaces add up: opacities between those of one surface and 1.
  EXPECT_GT(std::count_if(image.channels.at("A").begin(), image.channels.at("A").end(),
                          [](float a) { return a > 0.7f && a < 0.99f; }),
            20);
}

TEST(BezierScene, TrimmedSurfacesHaveThePictureOfTheJudge) {
  Scene scene = sceneOf(bezier_scenes::trimmedSurface());
  scene.camera.from = {0.5, 1.5, 2.5};
  const Image image = renderCpu(scene, kPlain);
  const ImageComparison found = compareImages(image, renderEmbree(scene, kPlain));
  EXPECT_TRUE(found.agrees()) << found.reason();
  EXPECT_GT(found.bothHit, 50U);
}

TEST(BezierScene, IsReadAndWritten) {
  const support::TemporaryFolder folder;
  Scene scene = sceneOf(bezier_scenes::dice());
  scene.beziers[0].opacity = 0.75;
  scene.solids.push_back(
      {.band = levelset::makeSphere(0.6, V3d(2, 0, 0), 0.1), .id = 8, .name = "ball"});
  const std::filesystem::path file = folder.path() / "scene.json";
  writeScene(file, {scene, true});
  const ViewedScene again = readScene(file);
  ASSERT_EQ(again.scene.beziers.size(), 1U);
  EXPECT_EQ(again.scene.beziers[0].name, "bezier");
  EXPECT_EQ(again.scene.beziers[0].id, 5U);
  EXPECT_EQ(again.scene.beziers[0].opacity, 0.75);
  const Image before = renderCpu(scene, kPlain), after = renderCpu(again.scene, kPlain);
  EXPECT_EQ(before.channels.at("Z"), after.channels.at("Z"));
  EXPECT_EQ(before.ids, after.ids);
}

TEST(BezierScene, ReportsSingularPixels) {
  // The ray in the middle meets the point where two balls touch, and no other ray does.
  Scene scene = sceneOf(bezier_scenes::touchingBalls());
  scene.camera = {.from = {0, -6, 0}, .up = {0, 0, 1}, .width = 5, .height = 5};
  const Image image = renderCpu(scene, kPlain);
  EXPECT_EQ(image.attributes.at("ls:bezierSingular"), "1");
  EXPECT_FALSE(image.attributes.contains("ls:warning"));
  EXPECT_FALSE(renderCpu(sceneOf(bezier_scenes::sphere(2)), kPlain)
                   .attributes.contains("ls:bezierSingular"));
}

TEST(BezierScene, WarnsOfRaysThatGiveUp) {
  // The expression leaves nothing of the plane z = 0, in which the rays of the middle row lie.
  BezierVolume volume{{bezier_scenes::boxPatch({2, 2, 2}, V3d(-1), V3d(1))}};
  bezier_scenes::addAttribute(volume.patches[0], {{{1}, {1}, {0, 1}}}, V3d(-1), V3d(1));
  bezier_scenes::addAttribute(volume.patches[0], {{{-1}, {1}, {1}}}, V3d(-1), V3d(1));
  volume.expression = {0, 1, -3};
  Scene scene = sceneOf(volume);
  scene.camera = {.from = {0, -6, 0}, .up = {0, 0, 1}, .width = 3, .height = 3};
  const Image image = renderCpu(scene, kPlain);
  ASSERT_TRUE(image.attributes.contains("ls:bezierOverruns"));
  const std::string& warning = image.attributes.at("ls:warning");
  EXPECT_NE(warning.find("rays gave up"), std::string::npos) << warning;
  EXPECT_NE(warning.find("20000 undecided parts"), std::string::npos) << warning;
}

TEST(BezierScene, WarnsOfRaysThatGiveUpAndOfBandsInOneText) {
  Scene scene = sceneOf(bezier_scenes::sphere(2));
  Image image(scene.camera.width, scene.camera.height);
  const PictureLayers layers(image, scene, kPlain);
  layers.overruns = 2;
  layers.beyondBand = 3;
  layers.addWarnings(image, scene);
  const std::string& warning = image.attributes.at("ls:warning");
  EXPECT_NE(warning.find("rays gave up 2 times"), std::string::npos) << warning;
  EXPECT_NE(warning.find("surface. 3 pixels show the soft expression outside a band"),
            std::string::npos)
      << warning;
}

TEST(BezierScene, RefusesWhatIsNotDrawn) {
  const Scene scene = sceneOf(bezier_scenes::sphere(2));
  RenderOptions options = kPlain;
  options.thickness = true;
  EXPECT_THROW((void)renderCpu(scene, options), levelset::UsageError);
  EXPECT_THROW((void)renderEmbree(scene, options), levelset::UsageError);
  BezierVolume none = bezier_scenes::sphere(2);
  none.isovalue = 100;
  EXPECT_THROW((void)renderCpu(sceneOf(none), kPlain), levelset::InvalidInput);
}

}  // namespace bezier_scene_test
