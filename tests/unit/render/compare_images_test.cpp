#include "render/images/compare_images.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "render/embree/embree_renderer.h"
#include "render/scene/scene.h"
#include "tests/support/measured.h"

namespace compare_images_test {

using render::Image;
using render::ImageComparison;
using render::LayerComparison;

constexpr int kSize = 64;
constexpr float kMiss = std::numeric_limits<float>::infinity();

std::size_t at(int x, int y) {
  return static_cast<std::size_t>(y * kSize + x);
}

/// Disc with a radius of 20 pixels at a distance of five units.
Image disc() {
  Image image(kSize, kSize);
  auto& depth = image.addChannel("Z", kMiss);
  auto& normal = image.addChannel("N.Z");
  image.addChannel("N.X");
  image.addChannel("N.Y");
  image.addChannel("curvature.gauss");
  auto& id = image.ids["id"];
  id.assign(image.pixelCount(), 0);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x)
      if (std::hypot(x - 31.5, y - 31.5) < 20) {
        depth[at(x, y)] = 5;
        normal[at(x, y)] = 1;
        id[at(x, y)] = 7;
      }
  image.attributes["ls:voxelSize"] = "0.5";
  return image;
}

const LayerComparison& layerOf(const ImageComparison& found, const std::string& name) {
  const auto layer = std::find_if(found.layers.begin(), found.layers.end(),
                                  [&](const LayerComparison& l) { return l.layer == name; });
  EXPECT_NE(layer, found.layers.end()) << name;
  return *layer;
}

TEST(CompareImages, FindsNoDifferenceBetweenAPictureAndItself) {
  const Image image = disc();
  for (const bool exact : {false, true}) {
    const ImageComparison found = compareImages(image, image, {.exact = exact});
    EXPECT_TRUE(found.agrees()) << found.reason();
    EXPECT_EQ(found.differentBits, 0u);
    EXPECT_GT(found.bothHit, 1200u);
    EXPECT_EQ(layerOf(found, "Z").compared, found.bothHit);
    EXPECT_TRUE(layerOf(found, "Z").worst.empty());
  }
}

TEST(CompareImages, AcceptsNoLeakAndNoFalseHit) {
  const Image image = disc();
  Image leak = disc();
  leak.channels["Z"][at(30, 40)] = kMiss;
  const ImageComparison leaking = compareImages(image, leak);
  EXPECT_EQ(leaking.unlikeElsewhere, 1u);
  EXPECT_FALSE(leaking.agrees());
  EXPECT_NE(leaking.reason().find("30,40"), std::string::npos) << leaking.reason();
  EXPECT_EQ(leaking.difference.channels.at("coverage")[at(30, 40)], 1);
  Image ghost = disc();
  ghost.channels["Z"][at(2, 3)] = 4;
  const ImageComparison haunted = compareImages(image, ghost);
  EXPECT_EQ(haunted.unlikeElsewhere, 1u);
  EXPECT_FALSE(haunted.agrees());
  EXPECT_EQ(haunted.difference.channels.at("coverage")[at(2, 3)], -1);
}

TEST(CompareImages, ToleratesRoundingAtTheOutline) {
  // One of the 4096 pixels may differ, ⌈1e-5 × 4096⌉: the outermost pixel of the row.
  Image other = disc();
  auto& depth = other.channels["Z"];
  int first = 0;
  while (!std::isfinite(depth[at(first, 31)])) ++first;
  depth[at(first, 31)] = kMiss;
  const ImageComparison one = compareImages(disc(), other);
  EXPECT_EQ(one.unlikeAtOutline, 1u);
  EXPECT_EQ(one.unlikeElsewhere, 0u);
  EXPECT_TRUE(one.agrees()) << one.reason();
  depth[at(first, 32)] = kMiss;
  EXPECT_FALSE(compareImages(disc(), other).agrees());
}

TEST(CompareImages, ReportsSharesAndTheWorstPixels) {
  Image other = disc();
  auto& depth = other.channels["Z"];
  std::size_t changed = 0;
  for (std::size_t i = 0; i < depth.size(); ++i)
    if (std::isfinite(depth[i]) && changed < 5)
      depth[i] = 5 + 0.01f * static_cast<float>(++changed);
  const ImageComparison found = compareImages(disc(), other);
  const LayerComparison& layer = layerOf(found, "Z");
  EXPECT_EQ(layer.median, 0);
  EXPECT_EQ(layer.p99, 0);
  EXPECT_NEAR(layer.p999, 0.04 / 5.04, support::measured(7.51e-9));  // the second largest of 1256
  EXPECT_NEAR(layer.largest, 0.05 / 5.05, support::rounding(0.5));
  ASSERT_EQ(layer.worst.size(), 5u);
  for (std::size_t i = 1; i < 5; ++i) EXPECT_GT(layer.worst[i - 1].value, layer.worst[i].value);
  EXPECT_EQ(depth[at(layer.worst[0].x, layer.worst[0].y)], 5.05f);
  EXPECT_FALSE(found.agrees());
  EXPECT_TRUE(compareImages(disc(), other, {.tolerances = {{"Z", {0.02, 0.02}}}}).agrees());
  EXPECT_FALSE(compareImages(disc(), other, {.tolerances = {{"Z", {0.02, 0.005}}}}).agrees());
}

TEST(CompareImages, MeasuresAnglesAndCurvaturesInVoxels) {
  Image other = disc();
  const std::size_t i = at(31, 31);
  other.channels["N.X"][i] = static_cast<float>(std::sin(1e-4));
  other.channels["N.Z"][i] = static_cast<float>(std::cos(1e-4));
  other.channels["curvature.gauss"][i] = 0.04f;
  const ImageComparison found = compareImages(disc(), other);
  EXPECT_NEAR(layerOf(found, "N").largest, 1e-4, support::measured(2.48e-12));
  EXPECT_NEAR(layerOf(found, "curvature.gauss").largest, 0.25 * 0.04, support::measured(2.24e-10));
  EXPECT_TRUE(found.agrees()) << found.reason();
}

TEST(CompareImages, AcceptsJumpsOfNormalsOfTheSuperSpline) {
  Image first = disc(), second = disc();
  second.channels["N.X"][at(30, 30)] = 0.01f;
  EXPECT_FALSE(compareImages(first, second).agrees());
  first.attributes["ls:normal"] = "super-quadratic";
  EXPECT_FALSE(compareImages(first, second).agrees());
  second.attributes["ls:normal"] = "super-quadratic";
  EXPECT_TRUE(compareImages(first, second).agrees());
  second.channels["N.X"][at(30, 30)] = 0.2f;
  EXPECT_FALSE(compareImages(first, second).agrees());
  second.channels["N.X"][at(30, 30)] = 0.01f;
  for (int y = 25; y < 35; ++y) second.channels["N.X"][at(31, y)] = 0.01f;
  EXPECT_FALSE(compareImages(first, second).agrees());
}

TEST(CompareImages, NeverAcceptsNaNAsAgreement) {
  Image other = disc();
  other.channels["curvature.gauss"][at(31, 31)] = std::nanf("");
  for (const bool swapped : {false, true}) {
    const ImageComparison found =
        swapped ? compareImages(other, disc()) : compareImages(disc(), other);
    EXPECT_TRUE(std::isinf(layerOf(found, "curvature.gauss").largest));
    EXPECT_FALSE(found.agrees());
    EXPECT_FALSE(compareImages(swapped ? other : disc(), swapped ? disc() : other,
                               {.tolerances = {{"curvature.gauss", {1, 1}}}})
                     .agrees());
  }
}

TEST(CompareImages, CountsAnInvalidDepthAsNeitherHitNorMiss) {
  for (const float broken : {std::nanf(""), -kMiss})
    for (const auto& [x, y] : {std::pair{31, 31}, {0, 0}}) {
      Image other = disc();
      other.channels["Z"][at(x, y)] = broken;
      for (const Image& first : {disc(), other}) {
        const ImageComparison found = compareImages(first, other);
        EXPECT_EQ(found.unlikeElsewhere, 1u);
        EXPECT_FALSE(found.agrees());
      }
    }
}

TEST(CompareImages, ToleratesRoundingAtInnerOutlinesToo) {
  // A step in the middle of the disc. One pixel beside it belongs to the other side.
  const auto stepped = [](int column) {
    Image image = disc();
    for (int y = 0; y < kSize; ++y)
      for (int x = column; x < kSize; ++x)
        if (auto& z = image.channels["Z"][at(x, y)]; std::isfinite(z)) {
          z = 6;
          image.ids["id"][at(x, y)] = 9;
        }
    return image;
  };
  Image other = stepped(32);
  other.channels["Z"][at(32, 30)] = 5;
  other.ids["id"][at(32, 30)] = 7;
  const ImageComparison one = compareImages(stepped(32), other);
  EXPECT_EQ(one.unlikeAtOutline, 1u);
  EXPECT_TRUE(one.agrees()) << one.reason();
  // A depth that neither side has, or a pixel two pixels away from the step, is wrong.
  other.channels["Z"][at(32, 30)] = 4.5f;
  EXPECT_FALSE(compareImages(stepped(32), other).agrees());
  other = stepped(32);
  other.channels["Z"][at(34, 30)] = 5;
  EXPECT_FALSE(compareImages(stepped(32), other).agrees());
  // A complete column exceeds the tolerance.
  EXPECT_FALSE(compareImages(stepped(32), stepped(33)).agrees());
}

TEST(CompareImages, RequiresEqualIds) {
  Image other = disc();
  other.ids["id"][at(31, 31)] = 8;
  EXPECT_FALSE(compareImages(disc(), other).agrees());
}

TEST(CompareImages, RequiresEqualBitsAndChannels) {
  Image zero = disc();
  zero.channels["N.X"][at(0, 0)] = -0.0f;
  EXPECT_TRUE(compareImages(disc(), zero).agrees());
  const ImageComparison bits = compareImages(disc(), zero, {.exact = true});
  EXPECT_EQ(bits.differentBits, 1u);
  EXPECT_FALSE(bits.agrees());
  Image more = disc();
  more.addChannel("steps");
  EXPECT_EQ(compareImages(disc(), more).onlyOne, std::vector<std::string>{"steps"});
  EXPECT_TRUE(compareImages(disc(), more).agrees());
  EXPECT_FALSE(compareImages(disc(), more, {.exact = true}).agrees());
}

TEST(CompareImages, Refuses) {
  EXPECT_THROW((void)compareImages(disc(), Image(3, 4)), levelset::InvalidInput);
  Image bare(kSize, kSize);
  bare.addChannel("R");
  EXPECT_THROW((void)compareImages(bare, bare), levelset::InvalidInput);
  EXPECT_THROW((void)compareImages(disc(), disc(), {.tolerances = {{"depth", {1, 1}}}}),
               levelset::UsageError);
  for (const double bad : {-1.0, std::nan("")})
    EXPECT_THROW((void)compareImages(disc(), disc(), {.tolerances = {{"Z", {bad, 1}}}}),
                 levelset::UsageError);
}

TEST(CompareImages, AcceptsGeometryThatColourSamplesDoNotChange) {
  render::Scene scene;
  scene.camera.width = scene.camera.height = 48;
  scene.solids.push_back({.band = levelset::makeSphere(1, Imath::V3d(0), 0.1)});
  const Image one = render::renderEmbree(scene, {.samples = 1}),
              two = render::renderEmbree(scene, {.samples = 3});
  const ImageComparison found = compareImages(one, two);
  EXPECT_TRUE(found.agrees()) << found.reason();
  EXPECT_GT(found.differentBits, 0u);
  for (const char* layer : {"Z", "N", "P", "curvature.mean", "id"})
    EXPECT_EQ(layerOf(found, layer).largest, 0) << layer;
  EXPECT_GT(layerOf(found, "colour").largest, 0);
}

}  // namespace compare_images_test
