// CSG expressions evaluated along each ray: the parser, all crossings in order, and pictures
// compared with exact shapes, the judge and the GPU.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/transform.h"
#include "render/cpu/cpu_renderer.h"
#include "render/cpu/cpu_tracer.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/images/compare_images.h"
#include "render/kernel/kernel_scene.h"
#include "render/scene/csg_expression.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/render_scenes.h"

namespace csg_scene_test {

using Imath::V3d;
using levelset::NarrowBand;
using namespace render;

const std::vector<std::string> kNames = {"a", "b", "c"};
const RenderOptions kDataOnly = {.samples = 1, .ambientSamples = 0, .shadowSamples = 0};

/// Truth table of the expression over a, b and c at all eight points. `a` is the lowest bit.
unsigned truthOf(const std::string& text) {
  const CsgExpression csg(text, kNames);
  unsigned table = 0;
  for (unsigned n = 0; n < 8; ++n) {
    const char inside[3] = {static_cast<char>(n & 1), static_cast<char>(n >> 1 & 1),
                            static_cast<char>(n >> 2 & 1)};
    table |= unsigned{csg.holds(inside)} << n;
  }
  return table;
}

TEST(CsgExpression, EvaluatesAsWritten) {
  const unsigned a = 0xaa, b = 0xcc, c = 0xf0;
  EXPECT_EQ(truthOf("a"), a);
  EXPECT_EQ(truthOf(" a|b "), a | b);
  EXPECT_EQ(truthOf("a & b"), a & b);
  EXPECT_EQ(truthOf("a - b - c"), a & ~b & ~c & 0xff);
  EXPECT_EQ(truthOf("a - (b - c)"), a & ~(b & ~c) & 0xff);
  EXPECT_EQ(truthOf("a | b & c - a"), a | (b & (c & ~a)));  // operator precedence of Python
  EXPECT_EQ(truthOf("((a | b)) & c"), (a | b) & c);
}

TEST(CsgExpression, RefusesInvalidExpressions) {
  for (const char* text : {"", "a |", "| a", "a b", "(a", "a)", "a - d", "a + b", "a - 1", "a.b"})
    EXPECT_THROW(CsgExpression(text, kNames), levelset::UsageError) << text;
  EXPECT_THROW(CsgExpression(std::string(1000, '(') + "a", kNames), levelset::UsageError);
  std::string deep;
  for (int i = 0; i < 63; ++i) deep += "a - (";
  const std::string closed = deep + "a" + std::string(63, ')');
  EXPECT_NO_THROW(CsgExpression(closed, kNames));
  EXPECT_THROW(CsgExpression("a - (" + closed + ")", kNames), levelset::UsageError);
}

TEST(CsgExpression, ReportsThePositionOfAnError) {
  const auto box = [](double low, double high) { return Imath::Box3d(V3d(low), V3d(high)); };
  const std::vector<Imath::Box3d> boxes = {box(0, 2), box(1, 5), box(7, 8)};
  const auto boundsOf = [&](const char* text) { return CsgExpression(text, kNames).bounds(boxes); };
  EXPECT_EQ(boundsOf("a | b"), box(0, 5));
  EXPECT_EQ(boundsOf("a - b"), box(0, 2));
  EXPECT_EQ(boundsOf("a & b"), box(1, 2));
  EXPECT_TRUE(boundsOf("a & c").isEmpty());
  EXPECT_EQ(boundsOf("a & c | b"), box(1, 5));
}

/// Scene of two solids a and b, with the camera of a scene of `a` alone.
Scene sceneOfTwo(const NarrowBand& a, const NarrowBand& b, const std::string& csg) {
  Scene scene = support::sceneOf(a);
  scene.solids[0].name = "a";
  scene.solids.push_back({.band = b, .colour = Imath::C3f(0.2f, 0.3f, 0.7f), .id = 2, .name = "b"});
  scene.csg = CsgExpression(csg, {"a", "b"});
  return scene;
}

/// Ball minus a ball of another grid on the side of the eye.
Scene bittenBall() {
  Scene scene = sceneOfTwo(levelset::makeSphere(20, V3d(0.1, 0.2, 0.3), 1),
                           levelset::makeSphere(8, V3d(0.4, 0.5, 20), 0.37), "a - b");
  scene.camera.from = V3d(0, 0, 100);
  scene.camera.to = V3d(0);
  return scene;
}

/// Checks the pixel on the view axis.
void expectBitten(const Image& image, const char* what) {
  const std::size_t middle =
      static_cast<std::size_t>(image.height / 2) * static_cast<std::size_t>(image.width) +
      static_cast<std::size_t>(image.width / 2);
  EXPECT_NEAR(image.channels.at("Z")[middle], 88, support::measured(0.0393, 0.05)) << what;
  EXPECT_NEAR(image.channels.at("N.Z")[middle], 1, support::measured(0.00441))
      << what;  // normal of the concave cut
  EXPECT_NEAR(image.channels.at("curvature.mean")[middle], -1.0 / 8, support::measured(3.57e-5))
      << what;
  EXPECT_EQ(image.ids.at("id")[middle], 2u) << what;
}

TEST(CsgScene, ShowsTheInsideOfASubtractedSolid) {
  const Scene scene = bittenBall();
  expectBitten(renderCpu(scene, kDataOnly), "cpu");
  expectBitten(renderEmbree(scene, kDataOnly), "embree");
}

TEST(CsgScene, AgreesOnProcessorGpuAndJudge) {
  const NarrowBand ball = levelset::makeSphere(20, V3d(0.1, 0.2, 0.3), 1),
                   box = levelset::makeBox(V3d(24), V3d(8.1, 6.3, 9.2), 0.61);
  for (const char* csg : {"a | b", "a & b", "a - b", "b - a", "(a - b) | (b - a)"}) {
    for (const Filter filter : {Filter::Trilinear, Filter::BSplineQi}) {
      const Scene scene = sceneOfTwo(ball, box, csg);
      RenderOptions options = kDataOnly;
      options.filter = filter;
      const Image cpu = renderCpu(scene, options), judge = renderEmbree(scene, options),
                  gpu = renderGpu(scene, options);
      const ImageComparison found = compareImages(cpu, judge);
      EXPECT_GT(found.bothHit, cpu.pixelCount() / 50) << csg;
      EXPECT_TRUE(found.agrees()) << csg << ": " << found.reason();
      EXPECT_TRUE(compareImages(cpu, gpu, {.exact = true}).agrees()) << csg;
    }
  }
}

TEST(CsgScene, OfCoplanarFacesShowsTheLowerId) {
  const NarrowBand ball = levelset::makeSphere(20, V3d(0.1, 0.2, 0.3), 1);
  Scene scene = sceneOfTwo(ball, ball, "a & b");
  scene.solids[0].id = 9;
  const Image cpu = renderCpu(scene, kDataOnly), judge = renderEmbree(scene, kDataOnly);
  const ImageComparison found = compareImages(cpu, judge);
  EXPECT_TRUE(found.agrees()) << found.reason();
  EXPECT_EQ(cpu.ids.at("id")[cpu.pixelCount() / 2 + 80], 2u);
}

TEST(CsgScene, HasTheBitsOfTheGpuInItsShadowsToo) {
  const RenderOptions options = {.samples = 2, .ambientSamples = 3, .shadowSamples = 2};
  const Scene scene = bittenBall();
  const ImageComparison found =
      compareImages(renderGpu(scene, options), renderCpu(scene, options), {.exact = true});
  EXPECT_TRUE(found.agrees()) << found.reason();
}

TEST(CsgScene, MatchesTheOperatorOnGrids) {
  const NarrowBand a = levelset::makeSphere(20, V3d(0.1, 0.2, 0.3), 0.5),
                   b = levelset::makeSphere(15, V3d(12.3, 4, 9), 0.5);
  const Scene scene = sceneOfTwo(a, b, "a - b");
  Scene baked = scene;
  baked.solids = {{.band = levelset::subtract(a, b)}};
  baked.csg = {};
  const Image rays = renderCpu(scene, kDataOnly), grids = renderCpu(baked, kDataOnly);
  const std::vector<float>&z = rays.channels.at("Z"), &w = grids.channels.at("Z");
  std::size_t unlike = 0, hits = 0;
  for (std::size_t i = 0; i < z.size(); ++i) {
    if (std::isfinite(z[i]) != std::isfinite(w[i])) ++unlike;
    if (!std::isfinite(z[i]) || !std::isfinite(w[i])) continue;
    ++hits;
    if (std::abs(z[i] - w[i]) > 0.5f) ++unlike;  // the crease, which the grid rounds
  }
  EXPECT_GT(hits, z.size() / 10);
  EXPECT_LT(unlike, hits / 50);
}

TEST(CsgScene, DrawsNothingForAnEmptyResult) {
  const NarrowBand ball = levelset::makeSphere(20, V3d(0), 1),
                   far = levelset::makeSphere(5, V3d(50, 0, 0), 1),
                   larger = levelset::makeSphere(30, V3d(0), 1);
  for (const Scene& scene : {sceneOfTwo(ball, far, "a & b"), sceneOfTwo(ball, larger, "a - b")})
    for (const Image& image : {renderCpu(scene, kDataOnly), renderEmbree(scene, kDataOnly)})
      for (const float z : image.channels.at("Z")) ASSERT_FALSE(std::isfinite(z));
}

TEST(CsgScene, SubtractedPartsCastNoShadowAndHideNothing) {
  // A slab between the light and the ball counts only in a union.
  const NarrowBand ball = levelset::makeSphere(20, V3d(0), 1),
                   slab = levelset::makeBox(V3d(80, 4, 80), V3d(0, 40, 0), 1);
  const auto brightness = [&](const char* csg, bool isJudge) {
    Scene scene = sceneOfTwo(ball, slab, csg);
    scene.camera.from = V3d(0, 0, 100);
    scene.camera.to = V3d(0);
    const RenderOptions options = {.samples = 1, .ambientSamples = 0, .shadowSamples = 4};
    const Image image = isJudge ? renderEmbree(scene, options) : renderCpu(scene, options);
    double sum = 0;
    for (std::size_t i = 0; i < image.pixelCount(); ++i)
      if (image.ids.at("id")[i] == 1) sum += static_cast<double>(image.channels.at("G")[i]);
    return sum;
  };
  for (const bool isJudge : {false, true}) {
    EXPECT_NEAR(brightness("a - b", isJudge) / brightness("a", isJudge), 1, support::rounding(1));
    EXPECT_LT(brightness("a | b", isJudge), 0.9 * brightness("a", isJudge));
  }
}

TEST(CsgScene, DarkensAHollowWhoseWallsAreDeepInTheOtherSolid) {
  // Rays to the sky end inside the ball. Only the crossing beyond their end shows that the ball is
  // there.
  Scene scene = sceneOfTwo(levelset::makeSphere(40, V3d(0), 1),
                           levelset::makeCapsule(V3d(0, 0, -10), V3d(0, 0, 60), 5, 1), "a - b");
  scene.camera.from = V3d(0, 0, 200);
  scene.camera.to = V3d(0);
  const RenderOptions options = {.samples = 1, .ambientSamples = 64, .shadowSamples = 0};
  for (const Image& image : {renderCpu(scene, options), renderEmbree(scene, options)}) {
    const auto at = [&](int x, int y) {
      return static_cast<double>(image.channels.at(
          "G")[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
               static_cast<std::size_t>(x)]);
    };
    EXPECT_LT(at(image.width / 2, image.height / 2),
              0.5 * at(image.width / 2 + image.height / 8, image.height / 2));
  }
}

TEST(Thickness, MatchesTheExactSolids) {
  // Through a ball, and through the same ball minus a smaller ball of another grid.
  const NarrowBand ball = levelset::makeSphere(20, V3d(0), 0.5),
                   hole = levelset::makeSphere(8, V3d(0), 0.3);
  RenderOptions options = kDataOnly;
  options.thickness = true;
  for (const char* csg : {"a", "a - b", "a & b"}) {
    Scene scene = sceneOfTwo(ball, hole, csg);
    scene.camera.from = V3d(0, 0, 100);
    scene.camera.to = V3d(0);
    scene.camera.orthoHeight = 50;
    const Image cpu = renderCpu(scene, options), judge = renderEmbree(scene, options);
    for (const Image* image : {&cpu, &judge}) {
      for (int y = 0; y < image->height; ++y)
        for (int x = 0; x < image->width; ++x) {
          const double pixel = 50.0 / image->height;
          const double r2 = (std::pow(x + 0.5 - 0.5 * image->width, 2) +
                             std::pow(y + 0.5 - 0.5 * image->height, 2)) *
                            pixel * pixel;
          const auto chord = [&](double radius) {
            return r2 < radius * radius ? 2 * std::sqrt(radius * radius - r2) : 0;
          };
          const bool isGrazing = std::abs(r2 - 400) < 20 || std::abs(r2 - 64) < 8;
          if (isGrazing) continue;
          const double exact = csg == std::string("a")       ? chord(20)
                               : csg == std::string("a - b") ? chord(20) - chord(8)
                                                             : chord(8);
          const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(image->width) +
                         static_cast<std::size_t>(x);
          ASSERT_NEAR(image->channels.at("thickness")[i], exact, support::measured(0.0229)) << csg;
        }
    }
  }
}

TEST(Thickness, AgreesOnAllRenderersAlsoFromInside) {
  RenderOptions options = kDataOnly;
  options.thickness = true;
  Scene scene = support::sceneOf(support::rings());
  for (const bool isWithin : {false, true}) {
    if (isWithin) {
      scene.camera.from = V3d(24, 0.1, 0.2);
      scene.camera.to = V3d(20, 10, 1);
    }
    const Image cpu = renderCpu(scene, options);
    EXPECT_TRUE(compareImages(cpu, renderGpu(scene, options), {.exact = true}).agrees());
    const ImageComparison found = compareImages(cpu, renderEmbree(scene, options));
    EXPECT_TRUE(found.agrees()) << found.reason();
    for (const LayerComparison& layer : found.layers)
      EXPECT_TRUE(layer.layer != "thickness" || layer.median < 1e-6) << layer.median;
    if (!isWithin) continue;
    // From inside, the thickness extends at least to the first wall.
    for (std::size_t i = 0; i < cpu.pixelCount(); ++i)
      if (std::isfinite(cpu.channels.at("Z")[i])) {
        ASSERT_GE(cpu.channels.at("thickness")[i], cpu.channels.at("Z")[i] * 0.999f);
      }
  }
}

struct Crossing {
  double depth;
  bool enters;
  std::array<int, 3> cell;
};

/// All crossings of one ray in order, by the kernel.
std::vector<Crossing> allCrossings(const KernelSolid& solid, float x, float y) {
  const CpuTracer tracer;
  std::vector<Crossing> all;
  for (std::int32_t passing = 0; passing < 100; ++passing) {
    PixelBlock pixel(1);
    pixel.x[0] = x;
    pixel.y[0] = y;
    pixel.passing[0] = passing;
    HitBlock hits(pixel.size());
    ShapeBlock shapes(pixel.size());
    tracer.trace(solid, pixel, hits, shapes);
    if (!hits.found[0]) break;
    all.push_back({solid.fan.depthAt(static_cast<double>(hits.t[0])),
                   hits.found[0] == HitBlock::kEnters,
                   {hits.x[0], hits.y[0], hits.z[0]}});
  }
  return all;
}

/// A ball of noise with several sheets in each cell.
NarrowBand noise() {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> even(-1, 1);
  return support::sampleBand(
      [&](const V3d& p) {
        const double value = even(random);
        return p.length() < 9 ? value : 1;
      },
      Imath::Box3d(V3d(-10), V3d(10)), 1);
}

TEST(CsgScene, AgreesOnNoise) {
  const Scene scene = sceneOfTwo(noise(), levelset::makeSphere(7, V3d(3, 2, 1), 0.7), "a - b");
  const Image cpu = renderCpu(scene, kDataOnly);
  EXPECT_TRUE(compareImages(cpu, renderGpu(scene, kDataOnly), {.exact = true}).agrees());
  const Image judge = renderEmbree(scene, kDataOnly);
  std::size_t both = 0, unlike = 0;
  for (std::size_t i = 0; i < cpu.pixelCount(); ++i) {
    const float z = cpu.channels.at("Z")[i], w = judge.channels.at("Z")[i];
    if (std::isfinite(z) && std::isfinite(w)) ++both;
    if (std::isfinite(z) != std::isfinite(w) || (std::isfinite(z) && std::abs(z - w) > 2e-3f))
      ++unlike;
  }
  EXPECT_GT(both, 2000u);
  EXPECT_LE(unlike, both / 1000);  // rays that graze a sheet
}

TEST(AllCrossings, AreOrderedAndAlternateInAndOut) {
  for (const Filter filter : {Filter::Trilinear, Filter::BSpline, Filter::BSplineQi}) {
    std::size_t most = 0, inOneCell = 0, crossed = 0;
    for (const Scene& scene : {support::sceneOf(support::rings()), support::sceneOf(noise())}) {
      std::mt19937 random(3);
      std::uniform_real_distribution<float> wide(-0.45f, 0.45f);
      const KernelScene surfaces(scene, levelset::kNoMemoryLimit, filter);
      ASSERT_FALSE(surfaces.solids().empty());
      for (int n = 0; n < 2000; ++n) {
        const float x = wide(random) * static_cast<float>(scene.camera.width),
                    y = wide(random) * static_cast<float>(scene.camera.height);
        const std::vector<Crossing> all = allCrossings(surfaces.solids()[0], x, y);
        ASSERT_EQ(all.size() % 2, 0u);
        most = std::max(most, all.size());
        if (!all.empty()) ++crossed;
        for (std::size_t i = 0; i < all.size(); ++i) {
          ASSERT_EQ(all[i].enters, i % 2 == 0);
          if (i == 0) continue;
          ASSERT_GE(all[i].depth, all[i - 1].depth - 1e-3);
          if (all[i].cell == all[i - 1].cell) ++inOneCell;
        }
      }
    }
    EXPECT_GE(most, 4u);
    EXPECT_GT(inOneCell, 100u);
    EXPECT_GT(crossed, 500u);
  }
}

}  // namespace csg_scene_test
