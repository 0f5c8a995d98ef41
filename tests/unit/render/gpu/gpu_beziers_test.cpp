// Ray casting of Bézier volumes by compute shaders: equal bits as on the processor, and limits.

#include "render/gpu/bezier/gpu_beziers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <string>
#include <vector>

#include "levelset/shapes/shapes.h"
#include "render/cpu/cpu_renderer.h"
#include "render/gpu/device/gl_context.h"
#include "render/gpu/gpu_renderer.h"
#include "render/gpu/gpu_tracer.h"
#include "render/kernel/kernel_scene.h"
#include "tests/support/bezier_scenes.h"
#include "tests/support/teapot.h"

namespace gpu_beziers_test {

using bezier_scenes::BezierScene;
using bezier_scenes::V3d;
using namespace render;

const GlContext& context() {
  static const GlContext one;
  return one;
}

/// A GpuBeziers that frees its objects at the end.
struct Device {
  GpuBeziers beziers;
  explicit Device(std::size_t mostBytes = GpuBeziers::kMostBytes) : beziers(context(), mostBytes) {}
  ~Device() {
    context().run([&] { beziers.release(); });
  }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
};

bool haveSameBits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}
bool haveSameBits(const V3d& a, const V3d& b) {
  return haveSameBits(a.x, b.x) && haveSameBits(a.y, b.y) && haveSameBits(a.z, b.z);
}
bool haveSameBits(const BezierRoot& a, const BezierRoot& b) {
  return haveSameBits(a.depth, b.depth) && haveSameBits(a.distance, b.distance) &&
         a.patch == b.patch && a.attribute == b.attribute &&
         haveSameBits(a.parameter, b.parameter) && haveSameBits(a.normal, b.normal) &&
         a.isEntry == b.isEntry && a.isSingular == b.isSingular;
}

std::vector<Camera::Ray> raysOf(const Camera& camera) {
  std::vector<Camera::Ray> rays;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) rays.push_back(camera.ray(x + 0.5, y + 0.5));
  return rays;
}

/// Expects that all members of all roots have the bits of the processor.
void expectSameBits(Device& device, const std::string& name, const BezierVolume& volume,
                    const Camera& camera) {
  const std::vector<Camera::Ray> rays = raysOf(camera);
  for (const bool all : {true, false}) {
    const SharedTree tree(volume, camera, {.allRoots = all});
    const SharedTree::Roots expected = tree.rootsOf(rays),
                            found = device.beziers.rootsOn(tree, tree.screensOf(rays));
    EXPECT_GT(expected.roots.size(), rays.size() / 50) << name;
    ASSERT_EQ(found.first, expected.first) << name << (all ? ", all roots" : ", nearest");
    std::size_t unlike = 0;
    for (std::size_t n = 0; n < found.roots.size(); ++n)
      unlike += !haveSameBits(found.roots[n], expected.roots[n]);
    EXPECT_EQ(unlike, 0u) << name << (all ? ", all roots" : ", nearest");
  }
}

void expectSameBitsOfScenes(std::size_t cameras, int size) {
  Device device;
  for (const BezierScene& scene : bezier_scenes::scenes(cameras, size))
    for (const Camera& camera : scene.cameras)
      expectSameBits(device, scene.name, scene.volume, camera);
  EXPECT_EQ(device.beziers.counts().onProcessor, 0u);
  EXPECT_GT(device.beziers.counts().solutions, 1000u);
}

Camera cameraAt(const V3d& from, int size) {
  Camera camera;
  camera.from = from;
  camera.up = V3d(0.1, 0.2, 1);
  camera.width = camera.height = size;
  return camera;
}

TEST(GpuBeziers, HasTheBitsOfTheProcessor) {
  expectSameBitsOfScenes(2, 14);
}

TEST(SlowGpuBeziers, HasTheBitsOfTheProcessorFromTenSides) {
  expectSameBitsOfScenes(10, 64);
}

TEST(GpuBeziers, DrawsTheTeapotWithTheBitsOfTheProcessor) {
  const BezierVolume teapot = bezier_scenes::teapot();
  if (teapot.patches.empty()) GTEST_SKIP() << "the models are missing";
  Device device;
  bezier_scenes::Numbers numbers(3);
  expectSameBits(device, "teapot", teapot, bezier_scenes::randomCamera(teapot, numbers, 24));
}

TEST(SlowGpuBeziers, TakesAnyDegree) {
  // Newton's method goes on over several calls of the shader at degree 20. The patches differ in
  // their degrees.
  BezierVolume volume = bezier_scenes::sphere(3);
  BezierPatch patch = bezier_scenes::sphere(2).patches[0];
  for (int degree = 2; degree < 20; ++degree) patch = elevated(patch, 2);
  for (int degree = 2; degree < 7; ++degree) patch = elevated(patch, 0);
  for (V3d& point : patch.points) point.x += 2;
  volume.patches.push_back(patch);
  Device device;
  expectSameBits(device, "two spheres", volume, cameraAt(V3d(2, -5, 1.5), 7));
  EXPECT_EQ(device.beziers.counts().onProcessor, 0u);
}

TEST(SlowGpuBeziers, TakesTheHighestDegree) {
  BezierVolume volume = bezier_scenes::sphere(20);
  volume.patches[0].weights.assign(volume.patches[0].points.size(), 2.0);
  Device device;
  expectSameBits(device, "sphere of degree 20", volume, cameraAt(V3d(2, -3, 1.5), 8));
  EXPECT_EQ(device.beziers.counts().onProcessor, 0u);
}

TEST(GpuBeziers, StaysWithinItsMemory) {
  const BezierVolume volume = bezier_scenes::teardrop();
  const Camera camera = cameraAt(V3d(2, -2.5, 1), 24);
  Device large, small(5'000'000), tiny(600'000);
  for (Device* device : {&large, &small, &tiny})
    expectSameBits(*device, "teardrop", volume, camera);
  EXPECT_LE(large.beziers.counts().peakBytes, GpuBeziers::kMostBytes);
  EXPECT_EQ(large.beziers.counts().onProcessor, 0u);
  // Lists that do not fit are taken in parts.
  EXPECT_LE(small.beziers.counts().peakBytes, 5'000'000u);
  EXPECT_EQ(small.beziers.counts().onProcessor, 0u);
  EXPECT_GT(small.beziers.counts().parts, 2 * large.beziers.counts().parts);
  // Where not even one node fits, the processor takes the rays.
  EXPECT_LE(tiny.beziers.counts().peakBytes, 600'000u);
  EXPECT_GT(tiny.beziers.counts().onProcessor, 0u);
}

TEST(SlowGpuBeziers, LeavesRaysThatGiveUpToTheProcessor) {
  // The ray has a root of order four. With all roots, it gives up.
  Device device;
  expectSameBits(device, "touching balls", bezier_scenes::touchingBalls(),
                 cameraAt(V3d(0, -6, 0), 1));
  EXPECT_EQ(device.beziers.counts().onProcessor, 1u);
}

TEST(SlowGpuBeziers, LeavesRaysInTheSurfaceToTheProcessor) {
  // All of the box has the isovalue.
  BezierVolume full = bezier_scenes::sphere(2);
  for (double& value : full.patches[0].attributes[0]) value = 0;
  Device device;
  expectSameBits(device, "full box", full, cameraAt(V3d(0, -4, 0), 1));
  EXPECT_EQ(device.beziers.counts().onProcessor, 2u);
}

TEST(GpuBeziers, LeavesTinyVolumesToTheProcessor) {
  // Drivers may take numbers below the least normal one as 0.
  constexpr double kScale = 1e-60;
  BezierVolume volume = bezier_scenes::sphere(2);
  for (V3d& point : volume.patches[0].points) point *= kScale;
  Camera camera = cameraAt(V3d(2, -3, 1.5) * kScale, 8);
  Device device;
  expectSameBits(device, "tiny sphere", volume, camera);
  EXPECT_EQ(device.beziers.counts().onProcessor, 2u * 64);
}

TEST(GpuBeziers, EndsAtNearAndFar) {
  Device device;
  Camera camera = cameraAt(V3d(0, -4, 0), 17);
  camera.near = 3.3;
  expectSameBits(device, "behind the near end", bezier_scenes::sphere(3), camera);
  camera.near = 0;
  camera.far = 3.3;
  expectSameBits(device, "before the far end", bezier_scenes::sphere(3), camera);
}

TEST(GpuBeziers, NeedsNoRays) {
  Device device;
  const BezierVolume volume = bezier_scenes::sphere(2);
  const SharedTree tree(volume, cameraAt(V3d(0, -4, 0), 8));
  EXPECT_TRUE(device.beziers.rootsOn(tree, {}).roots.empty());
  const SharedTree::Roots beside = device.beziers.rootsOn(tree, {Imath::V2d(50, 50)});
  EXPECT_TRUE(beside.roots.empty());
  EXPECT_EQ(beside.first, (std::vector<std::size_t>{0, 0}));
}

TEST(GpuBeziers, DrawPicturesWithTheBitsOfTheProcessor) {
  // Two volumes beside a level set, with shadows.
  Scene scene;
  BezierVolume ball = bezier_scenes::sphere(2);
  for (V3d& point : ball.patches[0].points) point.x += 1;
  scene.beziers.push_back({.caster = BezierCaster(bezier_scenes::dice()), .id = 5});
  scene.beziers.push_back({.caster = BezierCaster(ball), .id = 6});
  scene.solids.push_back({.band = levelset::makeSphere(0.6, V3d(-1, 0, 1), 0.1), .id = 8});
  scene.camera = {.from = {0.4, 1.5, 6}, .to = {0.2, 0, 0}, .width = 48, .height = 36};
  const RenderOptions options{.samples = 1, .ambientSamples = 2, .shadowSamples = 1};
  const Image cpu = renderCpu(scene, options), gpu = renderGpu(scene, options);
  EXPECT_EQ(gpu.channels, cpu.channels);
  EXPECT_EQ(gpu.ids, cpu.ids);
  const std::vector<std::uint32_t>& ids = gpu.ids.at("id");
  for (const std::uint32_t id : {5u, 6u, 8u})
    EXPECT_GT(std::count(ids.begin(), ids.end(), id), 20) << id;
  EXPECT_FALSE(gpu.attributes.contains("ls:onProcessor"));
}

TEST(GpuBeziers, DrawTransparentAndTrimmedPartsWithTheBitsOfTheProcessor) {
  Scene scene;
  scene.beziers.push_back({.caster = BezierCaster(bezier_scenes::dice()), .id = 5, .opacity = 0.3});
  scene.beziers.push_back(
      {.caster = BezierCaster(bezier_scenes::trimmedSurface()), .id = 6, .opacity = 0.6});
  scene.solids.push_back(
      {.band = levelset::makeSphere(0.6, V3d(-1, 0, 1), 0.1), .id = 8, .opacity = 0.5});
  scene.camera = {.from = {0.4, 1.5, 6}, .to = {0.2, 0, 0}, .width = 32, .height = 24};
  const RenderOptions options{.samples = 2, .ambientSamples = 0, .shadowSamples = 1};
  const Image cpu = renderCpu(scene, options), gpu = renderGpu(scene, options);
  EXPECT_EQ(gpu.channels, cpu.channels);
  EXPECT_EQ(gpu.ids, cpu.ids);
}

/// Bézier volumes and a level set in one expression, with transparent operands and shadows.
TEST(GpuBeziers, DrawExpressionsWithTheBitsOfTheProcessor) {
  for (const double opacity : {1.0, 0.4}) {
    Scene scene;
    scene.solids.push_back(
        {.band = levelset::makeSphere(0.9, V3d(0.7, 0.3, 0.9), 0.1), .id = 8, .name = "ball"});
    scene.beziers.push_back({.caster = BezierCaster(bezier_scenes::dice()),
                             .id = 5,
                             .name = "die",
                             .opacity = opacity});
    BezierVolume small = bezier_scenes::sphere(3);
    for (V3d& point : small.patches[0].points) point = point * 0.4 + V3d(-1.2, 0.3, 0.5);
    scene.beziers.push_back({.caster = BezierCaster(small), .id = 6, .name = "small"});
    scene.csg = CsgExpression("(die - ball) | small", {"ball", "die", "small"});
    scene.camera = {.from = {0.4, 1.5, 6}, .to = {0.2, 0, 0}, .width = 24, .height = 18};
    const RenderOptions options{.samples = 1, .ambientSamples = 1, .shadowSamples = 1};
    const Image cpu = renderCpu(scene, options), gpu = renderGpu(scene, options);
    EXPECT_EQ(gpu.channels, cpu.channels);
    EXPECT_EQ(gpu.ids, cpu.ids);
    const std::vector<std::uint32_t>& ids = gpu.ids.at("id");
    for (const std::uint32_t id : {5u, 6u, 8u})
      EXPECT_GT(std::count(ids.begin(), ids.end(), id), 2) << id;
  }
}

TEST(GpuBeziers, PicturesTellOfRaysOnTheProcessor) {
  BezierVolume ball = bezier_scenes::sphere(2);
  for (double& value : ball.patches[0].attributes[0]) value *= 1e-40;
  Scene scene;
  scene.beziers.push_back({.caster = BezierCaster(ball), .id = 5});
  scene.camera = cameraAt(V3d(0, -4, 0), 8);
  const RenderOptions options{.samples = 1, .ambientSamples = 0, .shadowSamples = 0};
  const Image gpu = renderGpu(scene, options);
  EXPECT_EQ(gpu.channels, renderCpu(scene, options).channels);
  ASSERT_TRUE(gpu.attributes.contains("ls:onProcessor"));
  EXPECT_NE(gpu.attributes.at("ls:onProcessor").find("the processor cast"), std::string::npos);
}

TEST(GpuBeziers, AreUsedByTheTracer) {
  Scene scene;
  scene.beziers.push_back({.caster = BezierCaster(bezier_scenes::sphere(2)), .id = 5});
  scene.camera = cameraAt(V3d(0, -4, 0), 16);
  const KernelScene surfaces(scene);
  const GpuTracer tracer(context(), surfaces);
  const BezierHits found = surfaces.castBeziers(tracer, raysOf(scene.camera));
  ASSERT_GT(found.first[8 * 16 + 9], found.first[8 * 16 + 8]);
  EXPECT_TRUE(found.hits[found.first[8 * 16 + 8]].found);
  EXPECT_GT(tracer.bezierCounts().solutions, 100u);
  EXPECT_EQ(tracer.bezierCounts().onProcessor, 0u);
}

}  // namespace gpu_beziers_test
