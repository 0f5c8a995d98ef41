// Blocks that do not affect a picture are not stored, and the picture is unchanged.

#include "render/kernel/frustum_culling.h"

#include <gtest/gtest.h>

#include <string>

#include "levelset/csg/csg.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/transform.h"
#include "render/cpu/cpu_tracer.h"
#include "render/images/compare_images.h"
#include "render/kernel/kernel_scene.h"
#include "render/kernel/paint.h"
#include "tests/support/render_scenes.h"

namespace frame_need_test {

using Imath::V3d;
using levelset::NarrowBand;
using support::sceneOf;
using namespace render;

Image painted(const Scene& scene, const KernelScene& surfaces, const RenderOptions& options) {
  return paintPicture(scene, surfaces, CpuTracer(), 16, "cpu", options);
}

/// A long floor with a wall across it that shades one end. A part of the floor fills the frame.
Scene closeUp(const V3d& from, const V3d& to) {
  const NarrowBand floor = levelset::makeBox(V3d(1200, 8, 60), V3d(0), 1),
                   wall = levelset::makeBox(V3d(20, 60, 50), V3d(500, 30, 0), 1);
  Scene scene = sceneOf(levelset::unite(floor, wall), 96, 64);
  scene.camera.from = from;
  scene.camera.to = to;
  scene.camera.up = V3d(0, 0, 1);
  return scene;
}

/// Position in camera space.
V3d seenBy(const Camera& camera, const V3d& world) {
  const V3d axis = camera.axis(), right = axis.cross(camera.up).normalized();
  return {world.dot(right), world.dot(right.cross(axis)), -world.dot(axis)};
}

/// @param unseen  least share of the crossed blocks that must be left out
void expectTheSame(const Scene& scene, const RenderOptions& options, double unseen,
                   const std::string& what) {
  const KernelScene whole(scene), part(scene, options);
  EXPECT_EQ(whole.counts().culled, 0u) << what;
  EXPECT_GT(static_cast<double>(part.counts().culled),
            unseen * static_cast<double>(whole.counts().crossed))
      << what;
  EXPECT_LT(part.bytes(), whole.bytes()) << what;
  EXPECT_EQ(part.counts().crossed + part.counts().culled, whole.counts().crossed) << what;
  EXPECT_EQ(part.bounds(), whole.bounds()) << what;
  const ImageComparison found =
      compareImages(painted(scene, whole, options), painted(scene, part, options), {.exact = true});
  EXPECT_GT(found.bothHit, 1000u) << what;
  EXPECT_TRUE(found.agrees()) << what << ": " << found.reason();
}

TEST(FrustumCulling, KeepsBlocksThatAffectThePicture) {
  const RenderOptions options = {.samples = 2, .ambientSamples = 4, .shadowSamples = 4};
  Scene scene = closeUp(V3d(560, 90, 10), V3d(550, 4, 0));
  scene.key.direction = seenBy(scene.camera, V3d(0.5, 1, 0.1));
  expectTheSame(scene, options, 0.5, "close up");
  scene.key.direction = seenBy(scene.camera, V3d(0.1, 0.2, 1));
  scene.key.softness = 0.4;
  expectTheSame(scene, options, 0.5, "a low, wide light");
  scene.camera.orthoHeight = 40;
  expectTheSame(scene, options, 0.5, "orthographic");
  Scene inside = closeUp(V3d(500, 40, 0), V3d(490, 30, 2));
  inside.camera.up = V3d(0, 1, 0);
  inside.camera.verticalFov = 0.8;
  expectTheSame(inside, {.samples = 1, .ambientSamples = 2, .shadowSamples = 0}, 0.05,
                "from within");
}

TEST(FrustumCulling, KeepsOccludersOutsideTheFrame) {
  // The wall is outside the frame, but its shadow is inside.
  Scene scene = closeUp(V3d(540, 90, 0), V3d(539, 4, 0));
  scene.camera.verticalFov = 0.3;
  scene.key.direction = seenBy(scene.camera, V3d(-1, 0.8, 0));
  const RenderOptions lit = {.samples = 1, .ambientSamples = 0, .shadowSamples = 4},
                      unlit = {.samples = 1, .ambientSamples = 0, .shadowSamples = 0};
  expectTheSame(scene, lit, 0.5, "shaded");
  const KernelScene shaded(scene, lit), bare(scene, unlit);
  EXPECT_GT(shaded.counts().crossed, bare.counts().crossed + 50);
  EXPECT_FALSE(
      compareImages(painted(scene, shaded, lit), painted(scene, bare, lit), {.exact = true})
          .agrees());
}

TEST(FrustumCulling, KeepsOccludersNearTheStartOfShadowRays) {
  // Rays to the light start far off the coarse ball, measured in voxels of the fine sheet that
  // shades it.
  Scene scene;
  scene.solids.push_back({.band = levelset::makeSphere(4, V3d(0), 1), .id = 1});
  scene.solids.push_back(
      {.band = levelset::makeBox(V3d(0.05, 0.3, 1.2), V3d(-40, 3.14, 22.9), 0.005), .id = 2});
  scene.solids.push_back({.band = levelset::makeSphere(1, V3d(0, 90, 0), 0.05), .id = 3});
  scene.camera.width = scene.camera.height = 48;
  scene.camera.from = V3d(0, 2.83, 32.83);
  scene.camera.to = V3d(0, 2.83, 2.83);
  scene.camera.orthoHeight = 0.2;
  scene.key.direction = V3d(-1, 0, 0.5);
  scene.key.softness = 0.01;
  expectTheSame(scene, {.samples = 2, .ambientSamples = 0, .shadowSamples = 4}, 0.1, "coarse");
}

TEST(FrustumCulling, KeepsBlocksOfExpressionsThatAffectThePicture) {
  Scene scene = closeUp(V3d(560, 90, 10), V3d(550, 4, 0));
  scene.solids[0].name = "a";
  scene.solids.push_back(
      {.band = levelset::makeSphere(20, V3d(550, 4, 0), 1), .id = 2, .name = "b"});
  scene.solids.push_back(
      {.band = levelset::makeSphere(9, V3d(565, 4, 10), 1), .id = 3, .name = "c"});
  scene.csg = CsgExpression("a - b | c", {"a", "b", "c"});
  const RenderOptions lit = {.samples = 2, .ambientSamples = 0, .shadowSamples = 4};
  expectTheSame(scene, lit, 0.5, "shadows through an expression");
  // Rays to the sky continue to the end of the last solid.
  const RenderOptions open = {.samples = 1, .ambientSamples = 2, .shadowSamples = 0};
  EXPECT_EQ(KernelScene(scene, open).counts().culled, 0u);
}

TEST(FrustumCulling, StoresNoBlockOfASolidBehindTheCamera) {
  Scene scene = closeUp(V3d(560, 90, 10), V3d(550, 4, 0));
  scene.solids.push_back({.band = levelset::makeSphere(20, V3d(600, 300, 40), 1), .id = 2});
  const RenderOptions unlit = {.samples = 1, .ambientSamples = 0, .shadowSamples = 0};
  EXPECT_EQ(KernelScene(scene).solids().size(), 2u);
  EXPECT_EQ(KernelScene(scene, unlit).solids().size(), 1u);
  expectTheSame(scene, unlit, 0.8, "with one behind");
}

}  // namespace frame_need_test
