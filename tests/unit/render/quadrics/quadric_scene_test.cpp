// Pictures of quadrics: both renderers, shadows, other parts in the scene, and scene files.

#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "render/cpu/cpu_renderer.h"
#include "render/cpu/cpu_tracer.h"
#include "render/embree/embree_renderer.h"
#include "render/images/compare_images.h"
#include "render/kernel/kernel_scene.h"
#include "render/views/scene_file.h"
#include "tests/support/bezier_scenes.h"
#include "tests/support/files.h"
#include "tests/support/quadric_scenes.h"

namespace quadric_scene_test {

using Imath::V3d;
using quadric_scenes::Numbers;
using namespace render;

const RenderOptions kPlain{.samples = 1, .ambientSamples = 0, .shadowSamples = 0};

QuadricModel mixedModel() {
  Numbers numbers(11);
  QuadricModel model{
      quadric_scenes::ballsInCube(40, numbers), quadric_scenes::sticksInCube(30, numbers), {}};
  for (int n = 0; n < 6; ++n) {
    Quadric quadric =
        quadric_scenes::randomQuadric(static_cast<QuadricKind>(n), numbers.inBox(1), 2, numbers);
    for (V3d& axis : quadric.axes) axis *= 0.3;
    model.quadrics.push_back(quadric);
  }
  return model;
}

Scene sceneOf(const QuadricModel& model) {
  Scene scene;
  scene.quadrics.push_back({.caster = QuadricCaster(model), .id = 5, .name = "quadrics"});
  scene.camera = {.from = {0.4, 1.5, 4.5}, .to = {0.2, 0, 0}, .width = 48, .height = 36};
  return scene;
}

std::set<std::uint32_t> idsOf(const Image& image) {
  const std::vector<std::uint32_t>& ids = image.ids.at("id");
  return {ids.begin(), ids.end()};
}

TEST(QuadricScene, HasThePictureOfTheJudge) {
  const Scene scene = sceneOf(mixedModel());
  const Image image = renderCpu(scene, kPlain);
  const ImageComparison found = compareImages(image, renderEmbree(scene, kPlain));
  EXPECT_TRUE(found.agrees()) << found.reason();
  EXPECT_GT(found.bothHit, 200U);
  EXPECT_EQ(idsOf(image), (std::set<std::uint32_t>{0, 5}));
  EXPECT_EQ(image.attributes.at("ls:quadrics"), "76 quadrics");
}

TEST(QuadricScene, ShowsTheColoursOfItsQuadrics) {
  // Two spheres side by side, without light but that of the sky.
  Scene scene = sceneOf({{{V3d(-1.2, 0, 0), 1, packedColour({0.8f, 0, 0})},
                          {V3d(1.2, 0, 0), 1, packedColour({0, 0.8f, 0})}},
                         {},
                         {}});
  scene.camera = {.from = {0, 0, 6}, .width = 20, .height = 10};
  const Image image = renderCpu(scene, kPlain);
  const Image judged = renderEmbree(scene, kPlain);
  const auto& red = image.channels.at("R");
  const auto& green = image.channels.at("G");
  const std::size_t row = 5 * 20;
  EXPECT_GT(red[row + 5], 5 * green[row + 5]);
  EXPECT_GT(green[row + 14], 5 * red[row + 14]);
  for (std::size_t n = 0; n < red.size(); ++n)
    EXPECT_NEAR(red[n], judged.channels.at("R")[n], 1e-5);
}

TEST(QuadricScene, StandsBesideSolidsAndBezierVolumes) {
  Scene scene = sceneOf({{{V3d(0), 1, packedColour({1, 1, 1})}}, {}, {}});
  scene.solids.push_back({.band = levelset::makeSphere(0.6, V3d(1, 0, 0), 0.1), .id = 8});
  scene.beziers.push_back(
      {.caster = BezierCaster(bezier_scenes::sphere(2)), .id = 9, .name = "bezier"});
  // The Bézier volume is a ball of the same size, half hidden by an equal one before it.
  scene.quadrics[0] = {.caster = QuadricCaster({{{V3d(-0.7, 0, 0), 1, 0}}, {}, {}}), .id = 5};
  const Image image = renderCpu(scene, kPlain);
  EXPECT_EQ(idsOf(image), (std::set<std::uint32_t>{0, 5, 8, 9}));
  const ImageComparison found = compareImages(image, renderEmbree(scene, kPlain));
  EXPECT_TRUE(found.agrees()) << found.reason();
}

TEST(QuadricScene, BlocksLightAndReceivesShadows) {
  const Scene scene = sceneOf(mixedModel());
  const KernelScene surfaces(scene, RenderOptions{});
  Numbers numbers(3);
  std::vector<LightRay> rays;
  for (int n = 0; n < 400; ++n)
    rays.push_back({numbers.inBox(2), numbers.unit(), numbers.between(0.5, 3), 1});
  const std::vector<double> light = surfaces.transmittances(CpuTracer(), rays);
  const EmbreeScene judge(scene);
  std::size_t blocked = 0;
  for (std::size_t n = 0; n < rays.size(); ++n) {
    EXPECT_EQ(light[n] == 0,
              judge.isOccluded(rays[n].origin, rays[n].direction, 0, rays[n].maxDistance));
    blocked += light[n] == 0;
  }
  EXPECT_GT(blocked, 60U);
  EXPECT_LT(blocked, 340U);
  // A large ball hides the light of a small one below it.
  Scene pair = sceneOf({{{V3d(0, 3, 0), 2, 0xffffff}, {V3d(0), 0.5, 0xffffff}}, {}, {}});
  pair.key.direction = {0, 1, 0};
  pair.camera = {.from = {0, 0, 6}, .width = 9, .height = 9};
  const RenderOptions lit{.samples = 4, .ambientSamples = 0, .shadowSamples = 8};
  const Image dark = renderCpu(pair, lit);
  pair.quadrics[0].caster = QuadricCaster({{{V3d(0), 0.5, 0xffffff}}, {}, {}});
  const Image bright = renderCpu(pair, lit);
  const std::size_t middle = 4 * 9 + 4;
  EXPECT_GT(bright.channels.at("R")[middle], dark.channels.at("R")[middle] + 0.005f);
}

TEST(QuadricScene, HasTheSameBitsForAnyNumberOfThreads) {
  Numbers numbers(12);
  const QuadricModel model{quadric_scenes::ballsInCube(40'000, numbers), {}, {}};
  const Scene scene = sceneOf(model);
  const Image first = renderCpu(scene, kPlain), second = renderCpu(sceneOf(model), kPlain);
  EXPECT_EQ(first.channels.at("Z"), second.channels.at("Z"));
  EXPECT_EQ(first.channels.at("R"), second.channels.at("R"));
}

TEST(QuadricScene, IsReadAndWritten) {
  const support::TemporaryFolder folder;
  Scene scene = sceneOf(mixedModel());
  scene.solids.push_back(
      {.band = levelset::makeSphere(0.6, V3d(2, 0, 0), 0.1), .id = 8, .name = "ball"});
  const std::filesystem::path file = folder.path() / "scene.json";
  writeScene(file, {scene, true});
  const ViewedScene again = readScene(file);
  ASSERT_EQ(again.scene.quadrics.size(), 1U);
  EXPECT_EQ(again.scene.quadrics[0].name, "quadrics");
  EXPECT_EQ(again.scene.quadrics[0].id, 5U);
  const ImageComparison found =
      compareImages(renderCpu(scene, kPlain), renderCpu(again.scene, kPlain));
  EXPECT_TRUE(found.agrees()) << found.reason();
  const ViewedScene alone = readScene(folder.path() / "scene-quadrics.json");
  EXPECT_EQ(alone.scene.quadrics.at(0).caster.count(), 76U);
}

TEST(QuadricScene, RefusesBlendsAndThickness) {
  Scene scene = sceneOf(mixedModel());
  RenderOptions options = kPlain;
  options.thickness = true;
  EXPECT_THROW(static_cast<void>(renderCpu(scene, options)), levelset::UsageError);
  scene.solids.push_back({.band = levelset::makeSphere(0.6, V3d(0), 0.1), .id = 8});
  scene.solids.push_back({.band = levelset::makeSphere(0.6, V3d(1, 0, 0), 0.1), .id = 9});
  scene.morph = 0.5;
  EXPECT_THROW(static_cast<void>(renderCpu(scene, kPlain)), levelset::UsageError);
}

}  // namespace quadric_scene_test
