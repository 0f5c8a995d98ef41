// Ray casting of terrains by compute shaders: equal bits as on the processor, and limits.

#include "render/gpu/terrain/gpu_terrains.h"

#include <gtest/gtest.h>

#include <vector>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "render/cpu/cpu_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/scene/scene.h"
#include "render/terrain/rays/terrain_tables.h"
#include "tests/support/terrain_rays.h"

namespace gpu_terrains_test {

using Imath::V3d;
using levelset::HeightField;
using terrain_rays::Numbers;
using terrain_rays::shared;
using namespace render;

const GlContext& terrainContext() {
  static const GlContext one;
  return one;
}

/// A GpuTerrains that frees its objects at the end.
struct TerrainDevice {
  GpuTerrains terrains;
  explicit TerrainDevice(std::size_t largest = terrainContext().largestTable())
      : terrains(terrainContext(), largest) {}
  ~TerrainDevice() {
    terrainContext().run([&] { terrains.release(); });
  }
  TerrainDevice(const TerrainDevice&) = delete;
  TerrainDevice& operator=(const TerrainDevice&) = delete;
};

std::size_t expectSameBits(TerrainDevice& device, const TerrainCaster& caster,
                           const std::vector<Camera::Ray>& rays) {
  const std::vector<TerrainHit> found = device.terrains.firstHits(caster, rays);
  std::size_t hits = 0, unlike = 0;
  for (std::size_t n = 0; n < rays.size(); ++n) {
    const TerrainHit expected = caster.firstHit(rays[n]);
    hits += expected.found;
    unlike += found[n].found != expected.found || found[n].distance != expected.distance ||
              found[n].column != expected.column || found[n].halfRow != expected.halfRow ||
              found[n].normal != expected.normal;
  }
  EXPECT_EQ(unlike, 0U) << "of " << rays.size();
  return hits;
}

TEST(GpuTerrains, HaveTheBitsOfTheProcessor) {
  TerrainDevice device;
  HeightField far = support::randomTerrain(70, 45, 0.02, 2);
  far.origin += Imath::V2d(1e6, -3e6);
  for (const HeightField& field :
       {support::randomTerrain(2, 2, 0, 1), far, terrain_rays::roughGround(200, 150, 0.1)}) {
    const TerrainCaster caster(shared(field));
    const Imath::Box3d& box = caster.bounds();
    Numbers numbers(4);
    std::vector<Camera::Ray> rays;
    for (int n = 0; n < 4000; ++n) {
      const V3d from = box.center() + box.size() * numbers.inBox(n % 2 == 0 ? 0.5 : 2),
                to = box.center() + box.size() * numbers.inBox(0.5);
      rays.push_back({from, (to - from).normalized(), 0,
                      n % 3 == 0 ? numbers.between(0, 1) * box.size().length() : Camera::kNoDepth});
      if (n % 5 == 0) rays.back().direction = V3d(0, 0, n % 2 == 0 ? 1 : -1);
      if (n % 7 == 0) rays.back().direction = V3d(n % 2 == 0 ? 1 : -1, 0, 0);
      // From a corner of a cell.
      if (n % 11 == 0) rays.back().origin = {field.origin.x, field.origin.y, from.z};
    }
    EXPECT_GT(expectSameBits(device, caster, rays), 600U);
  }
}

TEST(GpuTerrains, FindRaysThatVisitManyNodes) {
  // A level ray above needles visits more nodes than the shader does in one call.
  HeightField field = support::terrainOf(1500, 1500, {1, 1}, [](double x, double y) {
    const auto odd = [](double v) { return static_cast<long>(std::floor(v)) % 2 != 0; };
    return odd(x) && odd(y) ? 1 : 0;
  });
  TerrainDevice device;
  const TerrainCaster caster(shared(std::move(field)));
  std::vector<Camera::Ray> rays;
  for (int n = 0; n < 40; ++n)
    rays.push_back({V3d(-760, -740 + n, 0.9999), V3d(1, 0.7 + 0.005 * n, 0).normalized()});
  expectSameBits(device, caster, rays);
  int longer = 0;
  for (const Camera::Ray& ray : rays) {
    HeightKernel kernel = caster.tables()->kernel();
    HeightKernel::HeightWalk walk = caster.tables()->start();
    kernel.walkHeights(caster.tables()->gridRay(ray), false, GpuTerrains::kMostSteps, walk);
    longer += walk.level <= caster.tables()->topLevel;
  }
  EXPECT_GT(longer, 0);
}

TEST(GpuTerrains, DrawThePictureOfTheProcessor) {
  Scene scene;
  scene.terrains.push_back(
      {.caster = TerrainCaster(shared(terrain_rays::hills(49, 49, 0.1)),
                               {.outside = Imath::Box3d(V3d(-1, -1, -1), V3d(1, 1, 1))}),
       .id = 3});
  scene.terrains.push_back(
      {.caster = TerrainCaster(shared(support::randomTerrain(7, 7, 0.1, 2))), .id = 4});
  scene.solids.push_back({.band = levelset::makeSphere(0.8, V3d(0, 0, 0), 0.1), .id = 5});
  scene.camera = {.from = {1.4, -5.5, 3.5}, .up = {0, 0, 1}, .width = 40, .height = 30};
  const RenderOptions options{.samples = 2, .ambientSamples = 2, .shadowSamples = 2};
  const Image expected = renderCpu(scene, options), found = renderGpu(scene, options);
  EXPECT_EQ(found.channels, expected.channels);
  EXPECT_EQ(found.ids, expected.ids);
}

TEST(GpuTerrains, RefuseTablesThatDoNotFit) {
  TerrainDevice device(1024);
  const TerrainCaster caster(shared(support::randomTerrain(40, 40, 0, 1)));
  EXPECT_THROW(
      static_cast<void>(device.terrains.firstHits(caster, {{V3d(0, 0, 5), V3d(0, 0, -1)}})),
      levelset::ResourceLimit);
}

}  // namespace gpu_terrains_test
