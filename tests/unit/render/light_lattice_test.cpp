#include "render/kernel/light_lattice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "levelset/shapes/shapes.h"
#include "render/cpu/cpu_renderer.h"
#include "render/cpu/cpu_tracer.h"
#include "render/kernel/paint.h"
#include "render/quadrics/quadric_part.h"
#include "tests/support/measured.h"
#include "tests/support/quadric_scenes.h"
#include "tests/support/render_scenes.h"

namespace {

using Imath::V3d;
using render::Hit;
using render::Image;
using render::LightLattice;
using render::PointLight;
using render::Scene;

/// Colours of a picture whose light is interpolated, beside those of the same picture in which each
/// colour sample traces its own light rays, 16 times as many as usual.
struct Difference {
  double rms = 0, largest = 0, mean = 0;
};

Difference differenceOf(const Scene& scene, int spacing, const render::RenderOptions& options) {
  render::RenderOptions traced = options, interpolated = options;
  traced.lightSpacing = 1;
  traced.ambientSamples *= 16;
  traced.shadowSamples *= 16;
  interpolated.lightSpacing = spacing;
  const Image truth = renderCpu(scene, traced), image = renderCpu(scene, interpolated);
  Difference result;
  double count = 0;
  for (std::size_t i = 0; i < truth.pixelCount(); ++i) {
    if (truth.channels.at("A")[i] == 0) continue;
    const double d = static_cast<double>(image.channels.at("G")[i] - truth.channels.at("G")[i]);
    result.rms += d * d;
    result.mean += d;
    result.largest = std::max(result.largest, std::abs(d));
    ++count;
  }
  result.rms = std::sqrt(result.rms / count);
  result.mean /= count;
  return result;
}

TEST(LightLattice, IsAsCloseToTheTruthAsTracedRays) {
  // Rings with a crease, where they shade each other.
  const Scene scene = support::sceneOf(support::rings(), 240, 180);
  const Difference traced = differenceOf(scene, 1, {}), found = differenceOf(scene, 4, {});
  EXPECT_LT(found.rms, support::measured(0.00453));
  EXPECT_LT(found.rms, traced.rms);
  EXPECT_LT(std::abs(found.mean), support::measured(1.27e-4));
  EXPECT_LE(found.largest, support::measured(0.0995));
}

TEST(LightLattice, IsAsCloseToTheTruthOnQuadrics) {
  // Flat ends of cylinders at several heights. Their normals agree, and their light differs.
  quadric_scenes::Numbers numbers(4);
  std::vector<render::Stick> sticks;
  constexpr int kEdge = 20;
  for (int n = 0; n < kEdge * kEdge; ++n) {
    const double x = 2.0 * (n % kEdge) / kEdge - 1, y = 2.0 * (n / kEdge) / kEdge - 1,
                 height = numbers.between(0, 0.05);
    sticks.push_back({V3d(x, y, -1), V3d(x, y, height), 0.0525f, 0xb4b4b4});
  }
  Scene scene;
  scene.quadrics.push_back(render::makeQuadricPart({}, sticks));
  scene.camera = {.from = {0.1, 0.15, 5}, .to = {0, 0, 0}, .width = 60, .height = 45};
  const Difference traced = differenceOf(scene, 1, {}), found = differenceOf(scene, 4, {});
  EXPECT_LE(found.rms, traced.rms);
  EXPECT_LT(traced.rms, support::measured(0.0069));
}

TEST(LightLattice, LeavesAnOpenSurfaceUnchanged) {
  // Nothing blocks the light of a ball, so that the interpolated shares are exact.
  const Scene scene = support::sceneOf(levelset::makeSphere(20, V3d(0), 1), 160, 120);
  EXPECT_LT(differenceOf(scene, 4, {}).largest, support::measured(0.00282));
}

TEST(LightLattice, KeepsShadowsThinnerThanItsSpacing) {
  // A rod with a diameter of a pixel casts its shadow on a plate. Light of one direction: the
  // shadow is as narrow as the rod.
  Scene scene = support::sceneOf(levelset::makeBox(V3d(60, 60, 4), V3d(0), 1), 128, 128);
  scene.camera.from = V3d(0, 0, 100);
  scene.camera.to = V3d(0);
  scene.camera.orthoHeight = 64;
  scene.key.direction = V3d(1, 0, 0.4);
  scene.key.softness = 0;
  scene.solids.push_back(
      {.band = levelset::makeCapsule(V3d(-9.4, -30, 4), V3d(-9.4, 30, 4), 0.5, 0.25), .id = 2});
  const render::RenderOptions options = {.samples = 4, .ambientSamples = 0, .shadowSamples = 1};
  const auto darkOf = [&](int spacing) {
    render::RenderOptions with = options;
    with.lightSpacing = spacing;
    const Image image = renderCpu(scene, with);
    int dark = 0;
    // The row through the middle shows the plate, from left to right.
    const auto at = [&](int x) {
      return image.channels.at("G")[static_cast<std::size_t>(64 * 128 + x)];
    };
    for (int x = 8; x < 120; ++x)
      if (image.ids.at("id")[static_cast<std::size_t>(64 * 128 + x)] == 1 && at(x) < 0.8f * at(100))
        ++dark;
    return dark;
  };
  const int truth = darkOf(1);
  EXPECT_GE(truth, 3);
  EXPECT_GE(darkOf(8), truth - 1);
  EXPECT_LE(darkOf(8), truth);
}

TEST(LightLattice, DoesNotDependOnTiles) {
  const Scene scene = support::sceneOf(support::rings(), 70, 50);
  const render::RenderOptions options;
  const render::KernelScene surfaces(scene, options);
  const auto picture = [&](int tile) {
    return paintPicture(scene, surfaces, render::CpuTracer(), tile, "cpu", options);
  };
  const Image one = picture(128);
  for (const int tile : {5, 16, 33}) {
    const Image tiles = picture(tile);
    for (const char* channel : {"R", "G", "B", "A"})
      EXPECT_EQ(one.channels.at(channel), tiles.channels.at(channel)) << tile;
  }
}

LightLattice::Node nodeOn(const V3d& position, const V3d& normal, const PointLight& light) {
  Hit hit;
  hit.found = true;
  hit.position = position;
  hit.normal = normal;
  return {hit, light};
}

TEST(LightLattice, InterpolatesOnlyWhereItsCornersAgree) {
  LightLattice lattice({0, 0, 8, 4}, 8, 4, 4);
  ASSERT_EQ(lattice.points().size(), 6u);
  EXPECT_FALSE(lattice.isEmpty());
  const auto nodes = [&] {
    std::vector<LightLattice::Node> all;
    for (const LightLattice::Point& p : lattice.points())
      all.push_back(nodeOn(V3d(p.x, p.y, 0), V3d(0, 0, 1), {0.5 + p.x / 100, 1}));
    return all;
  };
  lattice.setNodes(nodes());
  const Hit on = nodeOn(V3d(3, 1, 0), V3d(0, 0, 1), {}).hit;
  const LightLattice::Estimate estimate = lattice.at(3, 1, 3, 1, on);
  EXPECT_TRUE(estimate.isSkyKnown && estimate.isKeyKnown);
  EXPECT_NEAR(estimate.light.sky, 0.53, 1e-12);
  EXPECT_NEAR(estimate.light.key, 1, 1e-12);
  const auto isKnown = [&](const Hit& hit) { return lattice.at(3, 1, 3, 1, hit).isSkyKnown; };
  EXPECT_FALSE(isKnown(nodeOn(V3d(3, 1, 3), V3d(0, 0, 1), {}).hit)) << "in front of the plane";
  EXPECT_FALSE(isKnown(nodeOn(V3d(3, 1, 0), V3d(1, 0, 1).normalized(), {}).hit)) << "turned";
  Hit other = on;
  other.solid = 1;
  EXPECT_FALSE(isKnown(other)) << "another solid";
  const auto isKnownWith = [&](const LightLattice::Node& corner) {
    auto all = nodes();
    all[1] = corner;
    lattice.setNodes(all);
    return isKnown(on);
  };
  EXPECT_TRUE(isKnownWith(nodeOn(V3d(4, 0, 0), V3d(0, 0, 1), {0.54, 1})));
  EXPECT_FALSE(isKnownWith(nodeOn(V3d(4, 0, 0), V3d(0, 0, 1), {0.9, 1}))) << "other light";
  EXPECT_FALSE(isKnownWith(nodeOn(V3d(4, 0, 0), V3d(0, 1, 1).normalized(), {0.54, 1})));
  EXPECT_FALSE(isKnownWith({})) << "no surface";
}

}  // namespace
