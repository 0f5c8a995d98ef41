// Pictures of segmented fields: all renderers, hidden regions, light, and other parts in the scene.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "render/cpu/cpu_renderer.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/images/compare_images.h"
#include "tests/support/measured.h"
#include "tests/support/segmented_scenes.h"

namespace segmented_scene_test {

using Imath::V3d;
using levelset::RegionLabel;
using support::measured;
using support::rounding;
using namespace render;

Scene sceneOf(const levelset::SegmentedField& field, const std::vector<RegionLabel>& hidden,
              const Camera& camera) {
  Scene scene;
  scene.camera = camera;
  scene.segmented = SegmentedPart{InterfaceCaster(field, hidden)};
  return scene;
}

const RenderOptions kPlain{.samples = 1, .ambientSamples = 0, .shadowSamples = 0};

std::set<std::uint32_t> idsOf(const Image& image) {
  const std::vector<std::uint32_t>& ids = image.ids.at("id");
  return {ids.begin(), ids.end()};
}

TEST(SegmentedScene, HasThePictureOfTheJudge) {
  for (const support::SegmentedScene& each : support::segmentedScenes())
    for (const Camera& camera : support::segmentedViews(24, 18)) {
      const Scene scene = sceneOf(each.field, each.hidden, camera);
      const ImageComparison found =
          compareImages(renderCpu(scene, kPlain), renderEmbree(scene, kPlain));
      EXPECT_TRUE(found.agrees()) << each.name << ": " << found.reason();
      EXPECT_GT(found.bothHit, 30u) << each.name;
    }
}

TEST(SegmentedScene, HasTheSameBitsOnBothProcessors) {
  const support::SegmentedScene each = support::segmentedScenes()[4];
  const Scene scene = sceneOf(each.field, {5}, support::segmentedViews(24, 18)[0]);
  const RenderOptions options{.samples = 2, .ambientSamples = 4, .shadowSamples = 2};
  const Image cpu = renderCpu(scene, options), gpu = renderGpu(scene, options);
  for (const auto& [name, values] : cpu.channels) EXPECT_EQ(values, gpu.channels.at(name)) << name;
  EXPECT_EQ(cpu.ids, gpu.ids);
}

TEST(SegmentedScene, ColoursTheSidesAndHidesRegions) {
  const levelset::SegmentedField field = support::nestedBalls(1, 0.62, 0.1);
  Camera camera = support::segmentedViews(40, 40)[0];
  EXPECT_EQ(idsOf(renderCpu(sceneOf(field, {}, camera), kPlain)), (std::set<std::uint32_t>{0, 1}));
  EXPECT_EQ(idsOf(renderCpu(sceneOf(field, {1}, camera), kPlain)), (std::set<std::uint32_t>{0, 2}));
  // The near plane cuts the outer ball open. Its inside has the colour of the ball.
  camera.near = camera.from.length() - 0.3;
  const Image cut = renderCpu(sceneOf(field, {}, camera), kPlain);
  EXPECT_EQ(idsOf(cut), (std::set<std::uint32_t>{0, 1, 2}));
  // Cut below the top of the inner ball, whose inside is seen from within.
  const Image hollow = renderCpu(sceneOf(field, {1}, camera), kPlain);
  const auto centre = static_cast<std::size_t>(20 * 40 + 20);
  EXPECT_EQ(hollow.ids.at("id")[centre], 2u);
  EXPECT_NEAR(static_cast<double>(hollow.channels.at("Z")[centre]), camera.from.length() + 0.62,
              measured(0.0058));
}

TEST(SegmentedScene, CastsShadowsAndReceivesThem) {
  Scene scene = sceneOf(support::nestedBalls(0.5, 0.3, 0.05), {}, {});
  scene.camera = {.from = {0, 3, 4}, .to = {0, 0, 0}, .width = 48, .height = 48};
  scene.key = {.direction = {0, 1, 0.2}, .softness = 0.01};
  scene.ground = groundOf(scene, V3d(0, 1, 0));
  EXPECT_NEAR(scene.ground->point.y, -0.5, 0.01);
  const RenderOptions options{.samples = 1, .ambientSamples = 0, .shadowSamples = 1};
  const Image image = renderCpu(scene, options);
  std::size_t shadow = 0;
  for (std::size_t n = 0; n < image.pixelCount(); ++n)
    shadow += image.ids.at("id")[n] == 0 && image.channels.at("A")[n] > 0.5f;
  EXPECT_GT(shadow, 30u);
  const ImageComparison found = compareImages(image, renderEmbree(scene, options));
  EXPECT_TRUE(found.agrees()) << found.reason();
}

TEST(SegmentedScene, StandsBesideSolidsAndMeshes) {
  Scene scene = sceneOf(support::nestedBalls(0.5, 0.3, 0.05), {}, {});
  scene.solids.push_back({.band = levelset::makeSphere(0.4, V3d(0.5, 0, 0), 0.05), .id = 8});
  scene.camera = {.from = {0.4, 0.5, 4}, .to = {0.2, 0, 0}, .width = 40, .height = 30};
  for (const double opacity : {1.0, 0.4}) {
    scene.solids[0].opacity = opacity;
    const Image image = renderCpu(scene, kPlain);
    EXPECT_EQ(idsOf(image), (std::set<std::uint32_t>{0, 1, 8}));
    const Image judged = renderEmbree(scene, kPlain);
    const ImageComparison found = compareImages(image, judged);
    EXPECT_TRUE(found.agrees()) << found.reason();
    // Behind a transparent solid the interface shows in the colours of both renderers.
    double largest = 0;
    for (const char* name : {"R", "G", "B", "A"})
      for (std::size_t n = 0; n < image.pixelCount(); ++n)
        largest = std::max(largest, std::abs(static_cast<double>(image.channels.at(name)[n] -
                                                                 judged.channels.at(name)[n])));
    EXPECT_LE(largest, rounding(2)) << opacity;
  }
}

TEST(SegmentedScene, RefusesWhatIsNotDrawn) {
  Scene scene = sceneOf(support::nestedBalls(1, 0.62, 0.2), {}, support::segmentedViews(8, 6)[0]);
  RenderOptions options = kPlain;
  options.filter = Filter::BSpline;
  EXPECT_THROW((void)renderCpu(scene, options), levelset::UsageError);
  scene.segmented = SegmentedPart{InterfaceCaster(scene.segmented->caster.field(), {1, 2})};
  EXPECT_THROW((void)renderCpu(scene, kPlain), levelset::InvalidInput);
  EXPECT_THROW((void)renderEmbree(scene, kPlain), levelset::InvalidInput);
}

}  // namespace segmented_scene_test
