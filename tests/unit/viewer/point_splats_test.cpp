// Discs at the surface points of a band: positions, coverage, and the picture.

#include "apps/viewer/interaction/point_splats.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>

#include "levelset/csg/csg.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/transform.h"
#include "render/cpu/cpu_renderer.h"

namespace point_splats_test {

using namespace viewer;
using Imath::V3d;

render::Scene sceneOf(const levelset::NarrowBand& band) {
  render::Scene scene;
  scene.solids.push_back({.band = band, .name = "solid"});
  scene.camera.from = {1, 2, 5};
  scene.camera.width = 120;
  scene.camera.height = 90;
  return scene;
}

std::shared_ptr<render::Image> splatted(const render::Scene& scene) {
  std::vector<SurfaceDiscs> discs;
  for (const render::Solid& solid : scene.solids) discs.push_back(surfaceDiscs(solid.band));
  render::RenderOptions options;
  options.samples = 1;
  options.ambientSamples = options.shadowSamples = 0;
  return drawSplats(discs, scene, scene.bounds().size().length(), options, false);
}

TEST(SurfaceDiscs, LieOnTheSurface) {
  // A rotated and scaled grid: positions and normals are in world space.
  Imath::M44d matrix;
  matrix.rotate(V3d(0.3, 0.5, 0.7));
  matrix.scale(V3d(2.0));
  const levelset::NarrowBand band =
      levelset::transform(levelset::makeSphere(0.5, V3d(0), 0.05), matrix);
  const SurfaceDiscs discs = surfaceDiscs(band);
  ASSERT_FALSE(discs.positions.empty());
  double away = 0, tilt = 0;
  for (std::size_t i = 0; i < discs.positions.size(); ++i) {
    const V3d at(discs.positions[i]), normal(discs.normals[i]);
    away = std::max(away, std::abs(at.length() - 1));
    tilt = std::max(tilt, (normal - at.normalized()).length());
  }
  // World units, with voxels of 0.1.
  EXPECT_LT(away, 1e-3);
  EXPECT_LT(tilt, 1e-2);
  // A layer of √3 voxels holds area √3 / h² grid points.
  const double expected = 4 * std::numbers::pi * std::sqrt(3.0) / (0.1 * 0.1);
  EXPECT_NEAR(static_cast<double>(discs.positions.size()), expected, 0.05 * expected);
  EXPECT_NEAR(static_cast<double>(discs.radius), 1.25 * std::sqrt(3.0) / 2 * 0.1, 1e-6);
  EXPECT_TRUE(surfaceDiscs(levelset::NarrowBand{}).positions.empty());
}

/// Compares depths with the ray-cast picture of the same view. @return largest difference where
/// both show the surface; pixels that only the ray-cast picture shows count as holes
double worstDepth(const render::Scene& scene, std::size_t& holes, std::size_t& beyond) {
  const auto splats = splatted(scene);
  render::RenderOptions options;
  options.samples = 1;
  options.ambientSamples = options.shadowSamples = 0;
  const render::Image rays = render::renderCpu(scene, options);
  const std::vector<float>&a = splats->channels.at("Z"), &b = rays.channels.at("Z");
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::isfinite(a[i]) && std::isfinite(b[i]))
      worst = std::max(worst, static_cast<double>(std::abs(a[i] - b[i])));
    holes += !std::isfinite(a[i]) && std::isfinite(b[i]);
    beyond += std::isfinite(a[i]) && !std::isfinite(b[i]);
  }
  return worst;
}

TEST(PointSplats, CoverTheSurfaceWithoutHoles) {
  for (const bool isOrtho : {false, true}) {
    render::Scene scene =
        sceneOf(levelset::unite(levelset::makeSphere(1, V3d(0), 0.04),
                                levelset::makeBox(V3d(1.5, 0.6, 2.4), V3d(0), 0.04)));
    if (isOrtho) scene.camera.orthoHeight = 3.5;
    std::size_t holes = 0, beyond = 0;
    (void)worstDepth(scene, holes, beyond);
    // Discs at the outline and at edges reach up to their radius beyond the surface.
    EXPECT_EQ(holes, 0u);
    EXPECT_LT(beyond, 200u);
  }
}

TEST(PointSplats, ApproachTheSurfaceWithTheVoxelSize) {
  // Seen from far, only the front of a ball: the depths differ by the sagitta of a disc, h².
  std::vector<double> worst;
  for (const double voxel : {0.08, 0.04, 0.02}) {
    render::Scene scene = sceneOf(levelset::makeSphere(1, V3d(0), voxel));
    scene.camera.from = {0, 0, 5};
    scene.camera.verticalFov = 0.1;
    std::size_t holes = 0, beyond = 0;
    worst.push_back(worstDepth(scene, holes, beyond));
    EXPECT_EQ(holes + beyond, 0u);
  }
  EXPECT_LT(worst[2], 1e-3);
  EXPECT_GT(worst[0] / worst[2], 8);
}

TEST(PointSplats, ShadeLikeTheRays) {
  render::Scene scene = sceneOf(levelset::makeSphere(1, V3d(0), 0.02));
  const auto splats = splatted(scene);
  render::RenderOptions options;
  options.samples = 1;
  options.ambientSamples = options.shadowSamples = 0;
  const render::Image rays = render::renderCpu(scene, options);
  const std::size_t middle = 45 * 120 + 60;
  for (const char* name : {"R", "G", "B", "A", "N.X", "N.Z", "P.Y"})
    EXPECT_NEAR(splats->channels.at(name)[middle], rays.channels.at(name)[middle], 0.02) << name;
  EXPECT_EQ(splats->ids.at("id")[middle], 1u);
  EXPECT_EQ(splats->channels.at("A")[0], 0);
}

TEST(PointSplats, HaveTheSameBitsForAnyNumberOfThreads) {
  render::Scene scene = sceneOf(levelset::makeSphere(1, V3d(0), 0.03));
  scene.solids.push_back({.band = levelset::makeSphere(0.6, V3d(0.8, 0, 0.5), 0.03), .id = 2});
  const auto many = splatted(scene);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const auto single = splatted(scene);
  EXPECT_EQ(many->channels, single->channels);
  EXPECT_EQ(many->ids, single->ids);
}

TEST(PointSplats, LeaveOtherScenesToTheRays) {
  render::Scene scene = sceneOf(levelset::makeSphere(1, V3d(0), 0.1));
  EXPECT_TRUE(canSplat(scene));
  scene.solids[0].opacity = 0.5;
  EXPECT_FALSE(canSplat(scene));
  EXPECT_FALSE(canSplat(render::Scene{}));
  // Stopped at once.
  std::atomic<bool> isStale = true;
  scene.solids[0].opacity = 1;
  EXPECT_EQ(drawSplats({surfaceDiscs(scene.solids[0].band)}, scene, 1, {}, isStale), nullptr);
}

}  // namespace point_splats_test
