// Effects by the compute shader: the same bits as on the processor.

#include "render/gpu/gpu_effects.h"

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <string>

#include "render/cpu/cpu_renderer.h"
#include "render/effects/picture_view.h"
#include "tests/support/render_scenes.h"
#include "tests/support/threads.h"

namespace gpu_effects_test {

using Imath::V3d;
using namespace render;

bool hasSameBits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

/// Layers of all kernels, by one runner.
std::vector<std::vector<float>> layersOf(const Image& image, const ScreenRunner& runner) {
  const PictureView view(image);
  std::vector<std::vector<float>> layers;
  for (const int spacing : {1, 3})
    layers.push_back(outlineLayer(
        view, {.width = 1.5 * spacing * spacing, .spacing = spacing, .step = 1}, runner));
  layers.push_back(occlusionLayer(view, {.radius = 15, .occluderDepth = 5}, runner));
  layers.push_back(shadowLayer(view, {.length = 200, .occluderDepth = 5}, runner));
  return layers;
}

TEST(GpuEffects, HaveTheBitsOfTheProcessor) {
  const std::unique_ptr<ScreenRunner> gpu = makeGpuScreenRunner();
  Scene within = support::sceneOf(support::rings());
  within.camera.from = V3d(24, 0.1, 0.2);
  within.camera.to = V3d(20, 10, 1);
  const std::pair<const char*, Scene> scenes[] = {
      {"rings", support::sceneOf(support::rings(), 96, 72)},
      {"lattice", support::alongTheLattice(support::rings(), V3d(100, 0, 0))},
      {"within", within}};
  std::vector<double> changes(4);  // of each layer, in all scenes
  for (const auto& [name, scene] : scenes) {
    const Image image = renderCpu(scene, {.samples = 1, .ambientSamples = 0, .shadowSamples = 0});
    const auto ofGpu = layersOf(image, *gpu), ofCpu = layersOf(image, CpuScreenRunner());
    for (std::size_t n = 0; n < ofCpu.size(); ++n) {
      EXPECT_TRUE(hasSameBits(ofGpu[n], ofCpu[n])) << name << " layer " << n;
      for (const float value : ofCpu[n])
        changes[n] += std::abs(static_cast<double>(value - ofCpu[n][0]));
    }
  }
  for (const double change : changes) EXPECT_GT(change, 100) << "a layer is constant";
}

TEST(GpuEffects, OfTheProcessorDoNotDependOnTheThreads) {
  const Image image = renderCpu(support::sceneOf(support::rings(), 96, 72),
                                {.samples = 1, .ambientSamples = 0, .shadowSamples = 0});
  const auto one = support::onThreads(1, [&] { return layersOf(image, CpuScreenRunner()); });
  const auto four = support::onThreads(4, [&] { return layersOf(image, CpuScreenRunner()); });
  EXPECT_EQ(one, four);
}

}  // namespace gpu_effects_test
