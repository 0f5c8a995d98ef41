// Values of 16 and 8 bits: the same surface on all renderers, with the stated error.

#include "render/images/value_bits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "levelset/vdb.h"
#include "render/bricks/brick_pool.h"
#include "render/cpu/cpu_renderer.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/images/compare_images.h"
#include "render/kernel/kernel_scene.h"
#include "tests/support/measured.h"
#include "tests/support/render_scenes.h"

namespace value_bits_test {

using Imath::V3d;
using levelset::NarrowBand;
using support::sceneOf;
using namespace render;

Scene coarseScene(const NarrowBand& band, int bits) {
  const QuantizedBand coarse = quantized(band, bits);
  Scene scene = sceneOf(coarse.band);
  scene.solids[0].quantization = coarse.quantization;
  scene.camera = sceneOf(band).camera;
  return scene;
}

TEST(ValueBits, KeepSignsAndTheirOwnRoundedValues) {
  for (const int bits : {8, 16}) {
    const ValueBits held{.bits = bits, .step = std::ldexp(3.0f, 1 - bits)};
    for (int code = 0; code < 1 << bits; ++code) EXPECT_EQ(held.codeOf(held.valueOf(code)), code);
    EXPECT_LT(held.valueOf(held.codeOf(-1e-30f)), 0);
    EXPECT_GT(held.valueOf(held.codeOf(0.0f)), 0);
    EXPECT_NEAR(held.valueOf(held.codeOf(3.0f)), 3, held.step);
    EXPECT_NEAR(held.valueOf(held.codeOf(-3.0f)), -3, held.step);
  }
}

TEST(ValueBits, MoveTheSurfaceByAtMostHalfAStep) {
  for (const double voxel : {1.0, 0.01}) {
    const NarrowBand band = levelset::makeSphere(40 * voxel, V3d(0.3, 0.2, 0.1) * voxel, voxel);
    double last = 1;
    for (const int bits : {8, 16}) {
      const QuantizedBand coarse = quantized(band, bits);
      const double step = static_cast<double>(coarse.quantization.step) / voxel;
      EXPECT_NEAR(step, 6 / (std::exp2(bits) - 1),
                  support::rounding(0.8) * step);  // a band of three voxels on each side
      EXPECT_LE(coarse.shift.largest, support::measured(0.493, 0.5) * step * 1.01);
      EXPECT_GT(coarse.shift.largest, 0.4 * step);
      // Uniform rounding gives an RMS of half a step divided by √3, less the effect of averaging
      // two values.
      EXPECT_GT(coarse.shift.rms, 0.15 * step);
      EXPECT_LT(coarse.shift.rms, 0.29 * step);
      EXPECT_LT(coarse.shift.largest, support::measured(0.0117) * last);
      last = coarse.shift.largest;
      EXPECT_EQ(coarse.band.activeVoxelCount(), band.activeVoxelCount());
      EXPECT_NEAR(coarse.band.halfWidth(), band.halfWidth(), support::rounding(3));
      EXPECT_EQ(quantized(coarse.band, bits).band.activeVoxelCount(), band.activeVoxelCount());
    }
  }
}

TEST(ValueBits, MakeTheTablesSmaller) {
  const NarrowBand band = levelset::makeSphere(60, V3d(0.3, 0.2, 0.1), 1);
  const KernelScene whole(sceneOf(band));
  for (const int bits : {8, 16}) {
    const KernelScene coarse(coarseScene(band, bits));
    EXPECT_EQ(coarse.counts().crossed, whole.counts().crossed);
    const double share = static_cast<double>(coarse.solids()[0].pool.valueBytes()) /
                         static_cast<double>(whole.solids()[0].pool.valueBytes());
    EXPECT_NEAR(share, bits / 32.0, support::doubleRounding(4));
    // The tables contain the values of the band.
    const BrickPool pool = makeBricks(coarseScene(band, bits).solids[0].band);
    const BrickPool& codes = coarse.solids()[0].pool;
    for (std::size_t i = 0; i < pool.value.size(); ++i) {
      int code = 0;
      for (int b = 0; b < bits / 8; ++b)
        code |= codes.code[i * static_cast<std::size_t>(bits / 8) + static_cast<std::size_t>(b)]
                << (8 * b);
      ASSERT_EQ(codes.quantization.valueOf(code), pool.value[i]);
    }
  }
}

TEST(ValueBits, AgreeOnAllRenderers) {
  for (const int bits : {8, 16}) {
    for (const NarrowBand& band :
         {levelset::makeSphere(20, V3d(0.3, 0.2, 0.1), 1), support::rings(),
          levelset::makeBox(V3d(30, 30, 0.7), V3d(0.1, 0.2, 0.3), 1)}) {
      const Scene scene = coarseScene(band, bits);
      const RenderOptions options = {.samples = 2, .ambientSamples = 3, .shadowSamples = 2};
      const Image cpu = renderCpu(scene, options), gpu = renderGpu(scene, options);
      const ImageComparison same = compareImages(gpu, cpu, {.exact = true});
      EXPECT_GT(same.bothHit, 100u);
      EXPECT_TRUE(same.agrees()) << bits << ": " << same.reason();
      const ImageComparison judged = compareImages(cpu, renderEmbree(scene, options));
      EXPECT_TRUE(judged.agrees()) << bits << ": " << judged.reason();
    }
  }
}

TEST(ValueBits, SupportSplinesWhoseCoefficientsAreValues) {
  for (const int bits : {8, 16})
    EXPECT_NO_THROW((void)renderCpu(coarseScene(levelset::makeSphere(9, V3d(0), 1), bits),
                                    {.samples = 1, .filter = Filter::BSpline}));
  const Scene scene = coarseScene(levelset::makeSphere(20, V3d(0.3, 0.2, 0.1), 1), 16);
  const RenderOptions options = {
      .samples = 1, .ambientSamples = 0, .shadowSamples = 0, .filter = Filter::BSpline};
  const Image cpu = renderCpu(scene, options);
  EXPECT_TRUE(compareImages(renderGpu(scene, options), cpu, {.exact = true}).agrees());
  EXPECT_TRUE(compareImages(cpu, renderEmbree(scene, options)).agrees());
  RenderOptions corrected = options;
  corrected.filter = Filter::BSplineQi;
  EXPECT_THROW((void)renderCpu(scene, corrected), levelset::UsageError);
  EXPECT_THROW((void)renderEmbree(scene, corrected), levelset::UsageError);
}

}  // namespace value_bits_test
