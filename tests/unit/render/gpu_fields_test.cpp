// Soft expressions and morphs by the compute shader: equal bits as by the processor, and limits.

#include "render/gpu/gpu_fields.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/transform.h"
#include "render/cpu/cpu_renderer.h"
#include "render/cpu/cpu_tracer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/gpu/gpu_tracer.h"
#include "render/images/compare_images.h"
#include "tests/support/field_scenes.h"

namespace gpu_fields_test {

using namespace support::fields;

const NarrowBand& ball() {
  static const NarrowBand band = levelset::makeSphere(12, V3d(0.1, 0.2, 0.3), 1, {.halfWidth = 4});
  return band;
}

/// A turned box on a finer grid.
const NarrowBand& block() {
  static const NarrowBand band =
      levelset::transform(levelset::makeBox(V3d(14, 11, 18), V3d(6, 4, 7), 0.7, {.halfWidth = 6}),
                          Imath::M44d().rotate(V3d(0.3, 0.5, 0.2)));
  return band;
}

const NarrowBand& ring() {
  static const NarrowBand band = levelset::transform(
      levelset::makeTorus(9, 3, V3d(4, -5, 6), V3d(0, 0, 1), 0.5, {.halfWidth = 8}),
      Imath::M44d().rotate(V3d(-0.4, 0.2, 0.7)));
  return band;
}

/// Draws the scene by both renderers, lit and with thickness, and expects equal bits.
void expectEqualBits(const Scene& scene, const std::string& what, int spacing = 4) {
  RenderOptions options = {
      .samples = 1, .ambientSamples = 2, .shadowSamples = 2, .lightSpacing = spacing};
  options.thickness = true;
  const Image gpu = renderGpu(scene, options), cpu = renderCpu(scene, options);
  const ImageComparison found = compareImages(gpu, cpu, {.exact = true});
  EXPECT_GT(found.bothHit, 500u) << what;
  EXPECT_EQ(found.differentBits, 0u) << what << ": " << found.reason();
  EXPECT_TRUE(found.agrees()) << what;
  EXPECT_EQ(gpu.channels.at("thickness"), cpu.channels.at("thickness")) << what;
}

TEST(GpuFields, HaveTheBitsOfTheProcessorForSoftExpressions) {
  for (const char* csg : {"a | b", "a - b", "a & b"})
    expectEqualBits(blended({ball(), block()}, csg, 2.5, 64, 48), csg);
  for (const char* csg : {"(a | b) - c", "c - (a & b) | b"})
    expectEqualBits(blended({ball(), block(), ring()}, csg, 2, 64, 48), csg);
}

TEST(GpuFields, HaveTheBitsOfTheProcessorForMorphs) {
  for (const double share : {0.0, 0.3, 0.5, 1.0})
    expectEqualBits(morphed(ball(), ring(), share, 64, 48), std::to_string(share));
}

}  // namespace gpu_fields_test
