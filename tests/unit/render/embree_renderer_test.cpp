#include "render/embree/embree_renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "levelset/error.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace embree_renderer_test {

using namespace render;
using Imath::V3d;

Scene sphereScene(int width, int height) {
  Scene scene;
  scene.solids.push_back({.band = support::sampleBand([](const V3d& p) { return p.length() - 1; },
                                                      {V3d(-1), V3d(1)}, 0.1),
                          .id = 12});
  scene.camera.width = width;
  scene.camera.height = height;
  return scene;
}

/// A ball over a slab, with shadows and occlusion.
Scene ballOverSlab(int width, int height) {
  Scene scene;
  scene.solids.push_back(
      {.band = support::sampleBand(
           [](const V3d& p) {
             const double slab =
                 std::max({std::abs(p.x) - 1.0, std::abs(p.z) - 1.0, std::abs(p.y + 0.8) - 0.2});
             return std::min(slab, (p - V3d(0, 0.1, 0)).length() - 0.6);
           },
           {V3d(-1, -1, -1), V3d(1, 0.7, 1)}, 0.06)});
  scene.camera = framingCamera(scene.solids[0].band.zeroSetBounds(), width, height);
  return scene;
}

void expectSameImage(const Image& a, const Image& b) {
  ASSERT_EQ(a.channels.size(), b.channels.size());
  for (const auto& [name, values] : a.channels) {
    const auto& other = b.channels.at(name);
    ASSERT_EQ(values.size(), other.size());
    EXPECT_EQ(std::memcmp(values.data(), other.data(), values.size() * sizeof(float)), 0) << name;
  }
  EXPECT_EQ(a.ids, b.ids);
  EXPECT_EQ(a.attributes, b.attributes);
}

TEST(EmbreeRenderer, LayersOfASphere) {
  const Scene scene = sphereScene(65, 65);
  const Image image = renderEmbree(scene, {.samples = 2, .ambientSamples = 4, .shadowSamples = 2});
  const auto& c = image.channels;
  for (const char* name : {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z",
                           "curvature.mean", "curvature.gauss", "curvature.k1", "curvature.k2"})
    ASSERT_EQ(c.at(name).size(), 65u * 65u) << name;
  const std::size_t centre = 32 * 65 + 32;
  EXPECT_NEAR(c.at("Z")[centre], 4, support::rounding(1) * 0.1 * 0.1);
  EXPECT_NEAR(c.at("N.Z")[centre], 1, support::rounding(1));
  EXPECT_NEAR(c.at("P.Z")[centre], 1, support::rounding(1) * 0.1 * 0.1);
  EXPECT_NEAR(c.at("curvature.mean")[centre], 1, support::measured(0.00243));
  EXPECT_NEAR(c.at("curvature.gauss")[centre], 1, support::measured(0.00486));
  EXPECT_EQ(image.ids.at("id")[centre], 12u);
  EXPECT_EQ(c.at("A")[centre], 1);
  EXPECT_GT(c.at("R")[centre], 0.1f);

  for (const auto& [name, values] : c)
    EXPECT_EQ(values[0], name == "Z" ? std::numeric_limits<float>::infinity() : 0) << name;
  EXPECT_EQ(image.ids.at("id")[0], 0u);
  EXPECT_EQ(image.attributes.at("ls:filter"), "trilinear");
  EXPECT_EQ(image.attributes.at("ls:renderer"), "embree 3.13.5");
  EXPECT_EQ(image.matrices.at("worldToNDC").size(), 16u);
}

// Z is measured along the axis, and P lies on the pixel's ray, for both kinds of camera.
TEST(EmbreeRenderer, DepthAndPositionAreConsistent) {
  Scene scene = sphereScene(40, 30);
  scene.camera.from = {2, 3, 4};
  for (const bool isOrthographic : {false, true}) {
    if (isOrthographic) scene.camera.orthoHeight = 2.2;
    const Image image = renderEmbree(
        scene, {.samples = 1, .ambientSamples = 0, .shadowSamples = 0, .curvature = false});
    EXPECT_FALSE(image.channels.contains("curvature.mean"));
    const auto& c = image.channels;
    int hits = 0;
    for (std::size_t i = 0; i < image.pixelCount(); ++i) {
      if (!image.ids.at("id")[i]) continue;
      ++hits;
      const V3d p(c.at("P.X")[i], c.at("P.Y")[i], c.at("P.Z")[i]);
      ASSERT_NEAR(p.length(), 1, support::measured(0.25) * 0.1 * 0.1);
      ASSERT_NEAR((p - scene.camera.from).dot(scene.camera.axis()), c.at("Z")[i],
                  support::rounding(4));
      V3d ndc;
      scene.camera.worldToNdc().multVecMatrix(p, ndc);
      ASSERT_NEAR(ndc.x * 40, static_cast<double>(i % 40) + 0.5, support::rounding(6));
      ASSERT_NEAR(ndc.y * 30, static_cast<double>(i / 40) + 0.5, support::rounding(8));
    }
    EXPECT_GT(hits, 200);
  }
}

// Under uniform light all of a convex solid sees the sky, so occlusion must not darken any pixel.
TEST(EmbreeRenderer, ConvexSolidIsUnoccluded) {
  Scene scene = sphereScene(48, 48);
  scene.key.strength = 0;
  expectSameImage(renderEmbree(scene, {.ambientSamples = 32}),
                  renderEmbree(scene, {.ambientSamples = 0}));
}

TEST(EmbreeRenderer, HollowsAndShadowsAreDarker) {
  const Scene scene = ballOverSlab(60, 45);
  const auto brightness = [&](const RenderOptions& options) {
    double sum = 0;
    const Image image = renderEmbree(scene, options);
    for (const float v : image.channels.at("G")) sum += static_cast<double>(v);
    return sum;
  };
  const double open = brightness({.ambientSamples = 0, .shadowSamples = 0});
  const double occluded = brightness({.ambientSamples = 8, .shadowSamples = 0});
  const double shadowed = brightness({.ambientSamples = 0, .shadowSamples = 4});
  EXPECT_LT(occluded, 0.98 * open);
  EXPECT_LT(shadowed, 0.98 * open);
  EXPECT_GT(occluded, 0.5 * open);
  EXPECT_GT(shadowed, 0.5 * open);
}

TEST(EmbreeRenderer, SamePixelsForAnyThreadCount) {
  const Scene scene = ballOverSlab(70, 50);
  const auto withThreads = [&](std::size_t threads) {
    return support::onThreads(
        threads, [&] { return renderEmbree(scene, {.samples = 3, .ambientSamples = 5}); });
  };
  const Image one = withThreads(1);
  expectSameImage(one, withThreads(2));
  expectSameImage(one, withThreads(4));
}

TEST(EmbreeRenderer, ReportsProgressAndCancels) {
  const Scene scene = sphereScene(64, 64);
  double last = 0;
  RenderOptions options{.samples = 1, .ambientSamples = 0, .shadowSamples = 0};
  options.progress = [&](double fraction) {
    EXPECT_GE(fraction, last);
    last = fraction;
    return true;
  };
  (void)renderEmbree(scene, options);
  EXPECT_EQ(last, 1);
  options.progress = [](double fraction) { return fraction < 0.5; };
  EXPECT_THROW((void)renderEmbree(scene, options), levelset::Cancelled);
}

TEST(EmbreeRenderer, Refuses) {
  EXPECT_THROW((void)renderEmbree(sphereScene(0, 0)), levelset::UsageError);
  EXPECT_THROW((void)renderEmbree(sphereScene(1000000, 1000000)), levelset::ResourceLimit);
  const Scene scene = sphereScene(16, 16);
  EXPECT_THROW((void)renderEmbree(scene, {.samples = 0}), levelset::UsageError);
  EXPECT_THROW((void)renderEmbree(scene, {.ambientSamples = -1}), levelset::UsageError);
  EXPECT_THROW((void)renderEmbree(scene, {.maxBytes = 1000}), levelset::ResourceLimit);
  Scene dark = scene;
  dark.key.direction = V3d(0);
  EXPECT_THROW((void)renderEmbree(dark), levelset::UsageError);
  Scene empty = scene;
  empty.solids.clear();
  EXPECT_THROW((void)renderEmbree(empty), levelset::InvalidInput);
}

}  // namespace embree_renderer_test
