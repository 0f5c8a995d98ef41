// Compares pictures of the kernel with those of the judge, layer by layer, with the tolerances of
// docs/rendering.md.

#include "render/cpu/cpu_renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/transform.h"
#include "render/embree/embree_renderer.h"
#include "render/images/compare_images.h"
#include "tests/support/measured.h"
#include "tests/support/render_scenes.h"

namespace cpu_renderer_test {

using Imath::V3d;
using levelset::NarrowBand;
using support::rings;
using support::sceneOf;
using namespace render;

const RenderOptions kDataOnly = {.samples = 1, .ambientSamples = 0, .shadowSamples = 0};

/// Reason for a difference from the judge; empty if the pictures agree.
std::string disagreement(const Scene& scene) {
  const Image ours = renderCpu(scene, kDataOnly), judge = renderEmbree(scene, kDataOnly);
  const ImageComparison found = compareImages(ours, judge);
  EXPECT_GT(found.bothHit, ours.pixelCount() / 50);
  return found.agrees() ? "" : found.reason();
}

TEST(CpuRenderer, AgreesWithTheJudge) {
  EXPECT_EQ(disagreement(sceneOf(levelset::makeSphere(20, V3d(0.3, 0.2, 0.1), 1))), "");
  EXPECT_EQ(disagreement(sceneOf(rings())), "");
  EXPECT_EQ(disagreement(sceneOf(levelset::makeBox(V3d(30, 30, 0.7), V3d(0.1, 0.2, 0.3), 1))), "");
}

TEST(CpuRenderer, AgreesForAnyUnitRotationAndPosition) {
  EXPECT_EQ(disagreement(sceneOf(levelset::makeSphere(2e-5, V3d(0), 1e-6))), "");
  const NarrowBand solid = rings();
  for (const double scale : {1e-3, 1.0, 1e6}) {
    Imath::M44d turn;
    turn.rotate(V3d(0.3, 0.5, 0.7));
    const NarrowBand placed =
        levelset::transform(solid, Imath::M44d().setScale(scale) * turn *
                                       Imath::M44d().setTranslation(V3d(3, -2, 5) * 100 * scale));
    EXPECT_EQ(disagreement(sceneOf(placed)), "") << scale;
  }
}

TEST(CpuRenderer, AgreesFromInsideFarAwayAndAlongTheLattice) {
  Scene scene = sceneOf(rings());
  scene.camera.from = V3d(24, 0.1, 0.2);  // inside the tube
  scene.camera.to = V3d(20, 10, 1);
  EXPECT_EQ(disagreement(scene), "");
  EXPECT_EQ(disagreement(support::seenFromFar(rings())), "");
  for (const NarrowBand& solid : {rings(), support::latticeBox()})
    for (const V3d& from : {V3d(0, 0, 100), V3d(100, 0, 0), V3d(0, 100, 0), V3d(-100, 0, 0)})
      EXPECT_EQ(disagreement(support::alongTheLattice(solid, from)), "") << from;
}

TEST(CpuRenderer, HasNoHoleInAFaceOfTheBoxAcrossTheView) {
  Scene scene = sceneOf(levelset::makeBox(V3d(32), V3d(0), 1), 101, 101);
  scene.camera.from = V3d(2e-5, 1.3e-5, 100);
  scene.camera.to = V3d(0);
  scene.camera.orthoHeight = 40;
  EXPECT_EQ(disagreement(scene), "");
  const Image image = renderCpu(scene, kDataOnly);
  for (const float z : image.channels.at("Z"))
    if (std::isfinite(z)) {
      ASSERT_NEAR(z, 84, support::rounding(100));
    }
}

TEST(CpuRenderer, AgreesCloseToAWideSolid) {
  Scene scene = sceneOf(levelset::makeBox(V3d(0.4, 0.4, 8), V3d(0.001, 0.002, 0.0037), 0.01));
  scene.camera.from = V3d(0.01, 0.03, 4.2);
  scene.camera.to = V3d(0, 0, 4);
  EXPECT_EQ(disagreement(scene), "");
}

TEST(CpuRenderer, DrawsTheNearerOfTwoSolids) {
  Scene scene = sceneOf(levelset::makeSphere(20, V3d(0), 1));
  scene.solids[0].id = 7;
  scene.solids.push_back(
      {.band = levelset::makeBox(V3d(18, 18, 18), V3d(14, 4, 10), 0.5), .id = 3});
  scene.solids.push_back(
      {.band = levelset::makeBox(V3d(18, 18, 18), V3d(14, 4, 10), 0.5), .id = 2});
  EXPECT_EQ(disagreement(scene), "");
  const Image image = renderCpu(scene, kDataOnly);
  std::size_t count[8] = {};
  for (const std::uint32_t id : image.ids.at("id")) ++count[id];
  EXPECT_GT(count[7], 1000u);
  EXPECT_GT(count[2], 1000u);
  EXPECT_EQ(count[3], 0u);  // same position: the lower id wins
}

TEST(CpuRenderer, HasTheColoursOfTheJudge) {
  // Rays to the lights are the same, so only rounding at occluders causes differences.
  const Scene scene = sceneOf(rings(), 96, 72);
  const RenderOptions options = {
      .samples = 2, .ambientSamples = 8, .shadowSamples = 2, .lightSpacing = 1};
  const Image ours = renderCpu(scene, options), judge = renderEmbree(scene, options);
  double sum = 0, covered = 0;
  std::size_t unlike = 0;
  for (const char* channel : {"R", "G", "B"}) {
    const auto &a = ours.channels.at(channel), &b = judge.channels.at(channel);
    for (std::size_t i = 0; i < a.size(); ++i) {
      sum += static_cast<double>(a[i] - b[i]);
      covered += static_cast<double>(b[i]);
      unlike += std::abs(a[i] - b[i]) > 0.1f;
    }
  }
  EXPECT_LT(std::abs(sum), support::measured(1.17e-4) * covered);
  EXPECT_LT(unlike, 20u);
}

TEST(CpuRenderer, Refuses) {
  EXPECT_THROW((void)renderCpu(Scene()), levelset::InvalidInput);
  const NarrowBand apart = levelset::unite(levelset::makeSphere(1, V3d(-1.1e8, 0, 0), 0.1),
                                           levelset::makeSphere(1, V3d(1.1e8, 0, 0), 0.1));
  EXPECT_THROW((void)renderCpu(sceneOf(apart)), levelset::ResourceLimit);
  Scene scene = sceneOf(levelset::makeSphere(20, V3d(0), 1), 32, 24);
  RenderOptions little = kDataOnly;
  little.maxBytes = 200000;  // enough for the picture only
  EXPECT_THROW((void)renderCpu(scene, little), levelset::ResourceLimit);
  scene.camera.to = scene.camera.from;
  EXPECT_THROW((void)renderCpu(scene), levelset::UsageError);
  scene = sceneOf(levelset::makeSphere(20, V3d(0), 1));
  RenderOptions stopped = kDataOnly;
  stopped.progress = [](double) { return false; };
  EXPECT_THROW((void)renderCpu(scene, stopped), levelset::Cancelled);
}

}  // namespace cpu_renderer_test
