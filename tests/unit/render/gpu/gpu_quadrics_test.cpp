// Ray casting of quadrics by compute shaders: equal bits as on the processor, and limits.

#include "render/gpu/quadrics/gpu_quadrics.h"

#include <gtest/gtest.h>

#include <vector>

#include "levelset/error.h"
#include "render/cpu/cpu_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/scene/scene.h"
#include "tests/support/quadric_scenes.h"

namespace gpu_quadrics_test {

using Imath::V3d;
using quadric_scenes::Numbers;
using namespace render;

const GlContext& quadricContext() {
  static const GlContext one;
  return one;
}

/// A GpuQuadrics that frees its objects at the end.
struct QuadricDevice {
  GpuQuadrics quadrics;
  explicit QuadricDevice(std::size_t largest = quadricContext().largestTable())
      : quadrics(quadricContext(), largest) {}
  ~QuadricDevice() {
    quadricContext().run([&] { quadrics.release(); });
  }
  QuadricDevice(const QuadricDevice&) = delete;
  QuadricDevice& operator=(const QuadricDevice&) = delete;
};

std::size_t expectSameBits(QuadricDevice& device, const QuadricCaster& caster,
                           const std::vector<Camera::Ray>& rays) {
  const std::vector<QuadricHit> found = device.quadrics.firstHits(caster, rays);
  std::size_t hits = 0, unlike = 0;
  for (std::size_t n = 0; n < rays.size(); ++n) {
    const QuadricHit expected = caster.firstHit(rays[n]);
    hits += expected.found;
    unlike += found[n].found != expected.found || found[n].distance != expected.distance ||
              found[n].slot != expected.slot || found[n].normal != expected.normal;
  }
  EXPECT_EQ(unlike, 0U) << "of " << rays.size();
  return hits;
}

QuadricModel modelOf(std::size_t balls, std::size_t sticks, int quadrics, const V3d& middle) {
  Numbers numbers(21);
  QuadricModel model{quadric_scenes::ballsInCube(balls, numbers),
                     quadric_scenes::sticksInCube(sticks, numbers),
                     {}};
  for (Ball& ball : model.balls) ball.centre += middle;
  for (Stick& stick : model.sticks) stick.a += middle, stick.b += middle;
  for (int n = 0; n < quadrics; ++n) {
    Quadric quadric = quadric_scenes::randomQuadric(static_cast<QuadricKind>(n % 6),
                                                    middle + numbers.inBox(1), 30, numbers);
    for (V3d& axis : quadric.axes) axis *= 0.15;
    model.quadrics.push_back(quadric);
  }
  return model;
}

TEST(GpuQuadrics, HaveTheBitsOfTheProcessor) {
  QuadricDevice device;
  for (const V3d& middle : {V3d(0), V3d(1e6, -1e6, 3e5)}) {
    const QuadricCaster caster(modelOf(300, 200, 120, middle));
    Numbers numbers(4);
    std::vector<Camera::Ray> rays;
    for (int n = 0; n < 6000; ++n)
      rays.push_back({middle + numbers.inBox(n % 2 == 0 ? 1 : 4), numbers.unit(), 0,
                      n % 3 == 0 ? numbers.between(0.2, 4) : Camera::kNoDepth});
    EXPECT_GT(expectSameBits(device, caster, rays), 1500U);
  }
}

TEST(GpuQuadrics, FindRaysThatVisitManyBoxes) {
  // More boxes than the shader visits in one call.
  QuadricDevice device;
  const QuadricCaster caster(modelOf(60'000, 0, 0, V3d(0)));
  Camera camera;
  camera.width = 24;
  camera.height = 16;
  std::vector<Camera::Ray> rays;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) rays.push_back(camera.ray(x + 0.5, y + 0.5));
  EXPECT_GT(expectSameBits(device, caster, rays), 100U);
}

TEST(GpuQuadrics, DrawThePictureOfTheProcessor) {
  Scene scene;
  scene.quadrics.push_back({.caster = QuadricCaster(modelOf(60, 60, 12, V3d(0))), .id = 3});
  scene.quadrics.push_back({.caster = QuadricCaster(modelOf(5, 0, 0, V3d(0.5))), .id = 4});
  scene.camera = {.from = {0.4, 1.5, 4.5}, .width = 40, .height = 30};
  const RenderOptions options{.samples = 2, .ambientSamples = 2, .shadowSamples = 2};
  const Image expected = renderCpu(scene, options), found = renderGpu(scene, options);
  EXPECT_EQ(found.channels, expected.channels);
  EXPECT_EQ(found.ids, expected.ids);
}

TEST(GpuQuadrics, RefuseTablesThatDoNotFit) {
  QuadricDevice device(1024);
  const QuadricCaster caster(modelOf(5000, 0, 0, V3d(0)));
  EXPECT_THROW(
      static_cast<void>(device.quadrics.firstHits(caster, {{V3d(0, 0, 5), V3d(0, 0, -1)}})),
      levelset::ResourceLimit);
}

}  // namespace gpu_quadrics_test
