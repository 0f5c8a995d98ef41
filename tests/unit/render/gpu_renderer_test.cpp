// Compares the compute shader with the same code on the processor: equal bits on every layer,
// colours included. Mesa's llvmpipe replaces a missing GPU.

#include "render/gpu/gpu_renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/transform.h"
#include "render/cpu/cpu_renderer.h"
#include "render/cpu/cpu_trace.h"
#include "render/gpu/device/gl_context.h"
#include "render/gpu/device/gl_objects.h"
#include "render/gpu/gpu_tracer.h"
#include "render/images/compare_images.h"
#include "tests/support/render_scenes.h"

namespace gpu_renderer_test {

using Imath::V3d;
using levelset::NarrowBand;
using support::rings;
using support::sceneOf;
using namespace render;

void expectSameBits(const Scene& scene, const std::string& what) {
  const RenderOptions options = {.samples = 2, .ambientSamples = 3, .shadowSamples = 2};
  const Image gpu = renderGpu(scene, options), cpu = renderCpu(scene, options);
  const ImageComparison found = compareImages(gpu, cpu, {.exact = true});
  EXPECT_GT(found.bothHit, 100u) << what;
  EXPECT_EQ(found.differentBits, 0u) << what << ": " << found.reason();
  EXPECT_TRUE(found.agrees()) << what;
}

TEST(GpuRenderer, HasTheBitsOfTheProcessor) {
  expectSameBits(sceneOf(levelset::makeSphere(20, V3d(0.3, 0.2, 0.1), 1)), "ball");
  expectSameBits(sceneOf(rings()), "rings");
  expectSameBits(sceneOf(levelset::makeBox(V3d(30, 30, 0.7), V3d(0.1, 0.2, 0.3), 1)), "sheet");
  expectSameBits(sceneOf(levelset::makeCapsule(V3d(-40, 3, 2), V3d(40, 7, 5), 0.5, 1)), "needle");
}

TEST(GpuRenderer, HasTheBitsOfTheProcessorFromInsideFarAwayAndAlongTheLattice) {
  Scene scene = sceneOf(rings());
  scene.camera.from = V3d(24, 0.1, 0.2);
  scene.camera.to = V3d(20, 10, 1);
  expectSameBits(scene, "from within");
  expectSameBits(support::seenFromFar(rings()), "far away");
  for (const V3d& from : {V3d(100, 0, 0), V3d(0, 0, -100)}) {
    expectSameBits(support::alongTheLattice(rings(), from), "along the lattice");
    expectSameBits(support::alongTheLattice(support::latticeBox(), from), "box on the lattice");
  }
}

TEST(GpuRenderer, HasTheBitsOfTheProcessorForSeveralSolids) {
  Scene scene = sceneOf(levelset::makeSphere(20, V3d(0), 1));
  scene.solids.push_back({.band = levelset::makeBox(V3d(18), V3d(14, 4, 10), 0.37), .id = 3});
  scene.solids.push_back({.band = levelset::makeBox(V3d(18), V3d(-14, 4, 10), 0.37), .id = 2});
  expectSameBits(scene, "three solids");
}

/// Compares with a picture from the NanoVDB grids themselves, without bricks.
void expectTheBitsOfNanoVdb(const Scene& scene, const std::string& what) {
  RenderOptions options = {.samples = 1, .ambientSamples = 1, .shadowSamples = 1};
  const Image bricks = renderCpu(scene, options);
  options.fromNanoVdb = true;
  const ImageComparison found = compareImages(renderGpu(scene, options), bricks, {.exact = true});
  EXPECT_GT(found.bothHit, 100u) << what;
  EXPECT_TRUE(found.agrees()) << what << ": " << found.reason();
}

TEST(GpuRenderer, HasTheBitsOfTheNanoVdbGrid) {
  expectTheBitsOfNanoVdb(sceneOf(levelset::makeSphere(20, V3d(0.3, 0.2, 0.1), 1)), "ball");
  expectTheBitsOfNanoVdb(sceneOf(rings()), "rings");
  expectTheBitsOfNanoVdb(sceneOf(levelset::makeBox(V3d(30, 30, 0.7), V3d(0.1, 0.2, 0.3), 1)),
                         "sheet");
  // Across the corners of nodes of all sizes, and beyond 2^20 voxels.
  expectTheBitsOfNanoVdb(sceneOf(levelset::makeSphere(20, V3d(4096, 0, -4096), 1)), "root tiles");
  expectTheBitsOfNanoVdb(sceneOf(levelset::makeSphere(20, V3d(-2e6, 9e6, 128), 1)), "far index");
  Scene scene = sceneOf(rings());
  scene.camera.from = V3d(24, 0.1, 0.2);
  scene.camera.to = V3d(20, 10, 1);
  expectTheBitsOfNanoVdb(scene, "from within");
  expectTheBitsOfNanoVdb(support::seenFromFar(rings()), "far away");
  for (const V3d& from : {V3d(100, 0, 0), V3d(0, 0, -100)})
    expectTheBitsOfNanoVdb(support::alongTheLattice(support::latticeBox(), from),
                           "box on the lattice");
}

TEST(GpuTracer, SplitsValuesOverStorageBlocks) {
  const Scene scene = sceneOf(levelset::makeSphere(30, V3d(0.3, 0.2, 0.1), 1));
  const KernelScene surfaces(scene);
  const GlContext context;
  ASSERT_GT(surfaces.bytes(), 4u << 17);
  const GpuTracer whole(context, surfaces), split(context, surfaces, 1u << 17);
  PixelBlock pixels(64 * 64);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    pixels.x[i] = static_cast<float>(i % 64) * 2 - 63.5f;
    pixels.y[i] = static_cast<float>(i / 64) * 1.5f - 47.25f;
  }
  HitBlock a(pixels.size()), b(pixels.size()), c(pixels.size());
  ShapeBlock shapesA(pixels.size()), shapesB(pixels.size()), shapesC(pixels.size());
  whole.trace(surfaces.solids()[0], pixels, a, shapesA);
  split.trace(surfaces.solids()[0], pixels, b, shapesB);
  tracePixels(surfaces.solids()[0].pool, surfaces.solids()[0].fan, pixels, c, shapesC);
  EXPECT_GT(std::count(a.found.begin(), a.found.end(), -1), 800);
  EXPECT_EQ(a.found, b.found);
  EXPECT_EQ(a.t, b.t);
  EXPECT_EQ(a.found, c.found);
  EXPECT_EQ(a.t, c.t);
  EXPECT_EQ(a.x, c.x);
  EXPECT_EQ(a.y, c.y);
  EXPECT_EQ(a.z, c.z);
  for (std::size_t p = 0; p < ShapeBlock::kParts; ++p)
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (!a.found[i]) continue;
      EXPECT_EQ(shapesA.part[p][i], shapesB.part[p][i]);
      EXPECT_EQ(shapesA.part[p][i], shapesC.part[p][i]);
    }
}

std::string refusalOf(const auto& job) {
  try {
    job();
  } catch (const levelset::ResourceLimit& error) {
    return error.what();
  }
  return "accepted";
}

TEST(GpuTracer, RefusesGridsThatDoNotFit) {
  const Scene scene = sceneOf(levelset::makeSphere(30, V3d(0.3, 0.2, 0.1), 1));
  const KernelScene surfaces(scene);
  const GlContext context;
  // With a NanoVDB grid no other table can be too large.
  const std::string refusal = refusalOf([&] { GpuTracer(context, surfaces, 1u << 14, &scene); });
  EXPECT_NE(refusal.find("buffer textures"), std::string::npos) << refusal;
  // The table of blocks alone exceeds this limit.
  EXPECT_NE(refusalOf([&] { GpuTracer(context, surfaces, 1u << 10); }).find("cpu"),
            std::string::npos);
  // The context remains usable after these errors.
  const GpuTracer good(context, surfaces);
}

TEST(GlContext, OutlivesAnotherContext) {
  const Scene scene = sceneOf(levelset::makeSphere(20, V3d(0.3, 0.2, 0.1), 1));
  const KernelScene surfaces(scene);
  const GlContext first;
  const GpuTracer tracer(first, surfaces);
  {
    const GlContext second;
    second.run([] {});
  }
  PixelBlock pixels(64);
  HitBlock hits(pixels.size());
  ShapeBlock shapes(pixels.size());
  EXPECT_NO_THROW(tracer.trace(surfaces.solids()[0], pixels, hits, shapes));
  EXPECT_EQ(hits.found[0], -1);
}

TEST(GlContext, ReportsShadersThatDoNotCompile) {
  const GlContext context;
  const std::string words = refusalOf([&] {
    context.run(
        [&] { (void)compileCompute(context, "#version 450 core\nvoid main() { x = 1; }"); });
  });
  EXPECT_NE(words.find("does not compile"), std::string::npos) << words;
  EXPECT_NE(words.find("--renderer cpu"), std::string::npos) << words;
}

TEST(ShapeBlock, DropsNumbersThatGpusComputeAsZero) {
  ShapeBlock shapes(2);
  for (std::size_t p = 0; p < ShapeBlock::kParts; ++p) {
    shapes.part[p][0] = p % 3 == 0 ? -1.7e-41f : p % 3 == 1 ? -0.0f : 1.2e-38f;
    shapes.part[p][1] = -1.7e-41f;
  }
  shapes.flush(0);
  for (std::size_t p = 0; p < ShapeBlock::kParts; ++p) {
    EXPECT_EQ(shapes.part[p][0], p % 3 == 2 ? 1.2e-38f : 0.0f);
    EXPECT_FALSE(std::signbit(shapes.part[p][0]));
    EXPECT_EQ(shapes.part[p][1], -1.7e-41f);
  }
}

TEST(GpuRenderer, Refuses) {
  EXPECT_THROW((void)renderGpu(Scene()), levelset::InvalidInput);
  Scene scene = sceneOf(levelset::makeSphere(20, V3d(0), 1));
  EXPECT_THROW((void)renderGpu(scene, {.progress = [](double p) { return p < 0.1; }}),
               levelset::Cancelled);
  scene.camera.width = 0;
  EXPECT_THROW((void)renderGpu(scene), levelset::UsageError);
}

}  // namespace gpu_renderer_test
