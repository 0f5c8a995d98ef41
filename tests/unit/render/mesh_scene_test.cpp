// Meshes beside level sets: depth, lighting and equal pictures of all renderers.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "levelset/mesh.h"
#include "levelset/shapes/shapes.h"
#include "render/cpu/cpu_renderer.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/images/compare_images.h"
#include "render/meshes/mesh_rays.h"
#include "tests/support/measured.h"
#include "tests/support/render_scenes.h"

namespace mesh_scene_test {

using Imath::V3d;
using namespace render;

const RenderOptions kDataOnly = {.samples = 1, .ambientSamples = 0, .shadowSamples = 0};

/// Rectangle with centre `middle`. `a` and `b` are half of its side vectors.
levelset::TriMesh sheet(const V3d& middle, const V3d& a, const V3d& b) {
  levelset::TriMesh mesh;
  mesh.positions = {middle - a - b, middle + a - b, middle + a + b, middle - a + b};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

/// A level-set ball seen along −z, and an oblique sheet through it.
Scene leaningScene(double unit = 1, const V3d& place = V3d(0), double away = 100) {
  Scene scene;
  scene.solids.push_back({.band = levelset::makeSphere(20 * unit, place, unit)});
  const V3d a = V3d(30, 0, 12) * unit, b = V3d(0, 25, 0) * unit;
  scene.meshes.push_back({std::make_shared<const levelset::TriMesh>(sheet(place, a, b)),
                          Imath::C3f(0.2f, 0.4f, 0.6f), 2, "sheet"});
  scene.camera.from = place + V3d(0, 0, away * unit);
  scene.camera.to = place;
  scene.camera.orthoHeight = 60 * unit;
  scene.camera.width = 120;
  scene.camera.height = 90;
  return scene;
}

/// Expects that each of the two is visible where it is nearer.
void expectMutualDepth(const Image& image, double unit, double away) {
  std::size_t onMesh = 0, onSolid = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const double pixel = 60.0 / image.height;
      const double px = (x + 0.5 - 0.5 * image.width) * pixel,
                   py = (0.5 * image.height - y - 0.5) * pixel;
      const double sheetZ = std::abs(px) < 30 && std::abs(py) < 25
                                ? px * 12 / 30
                                : -std::numeric_limits<double>::infinity();
      const double inBall = 400 - px * px - py * py;
      const double ballZ =
          inBall > 0 ? std::sqrt(inBall) : -std::numeric_limits<double>::infinity();
      const bool isEdge = std::abs(std::abs(px) - 30) < pixel ||
                          std::abs(std::abs(py) - 25) < pixel || std::abs(inBall) < 40 ||
                          std::abs(sheetZ - ballZ) < 0.2;
      if (isEdge) continue;
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                     static_cast<std::size_t>(x);
      const auto z = static_cast<double>(image.channels.at("Z")[i]);
      const double nearest = std::max(sheetZ, ballZ);
      ASSERT_EQ(std::isfinite(nearest), std::isfinite(z)) << px << ' ' << py;
      if (!std::isfinite(nearest)) continue;
      ASSERT_EQ(image.ids.at("id")[i], sheetZ > ballZ ? 2u : 1u) << px << ' ' << py;
      ASSERT_NEAR(away - z / unit, nearest, sheetZ > ballZ ? away * 1e-7 + 1e-5 : 0.1);
      ++(sheetZ > ballZ ? onMesh : onSolid);
    }
  EXPECT_GT(onMesh, 1000u);
  EXPECT_GT(onSolid, 500u);
}

TEST(MeshScene, HidesAndIsHiddenByDepth) {
  expectMutualDepth(renderCpu(leaningScene(), kDataOnly), 1, 100);
  expectMutualDepth(renderEmbree(leaningScene(), kDataOnly), 1, 100);
  for (const double unit : {1e-6, 1e5})
    expectMutualDepth(renderCpu(leaningScene(unit), kDataOnly), unit, 100);
  expectMutualDepth(renderCpu(leaningScene(1, V3d(0), 1e5), kDataOnly), 1, 1e5);
}

TEST(MeshScene, AgreesOnAllRenderers) {
  const RenderOptions options = {.samples = 2, .ambientSamples = 3, .shadowSamples = 2};
  Scene scene = leaningScene();
  const ImageComparison same =
      compareImages(renderGpu(scene, options), renderCpu(scene, options), {.exact = true});
  EXPECT_TRUE(same.agrees()) << same.reason();
  scene.solids.push_back({.band = levelset::makeSphere(8, V3d(0, 0, 18), 0.5), .id = 3});
  scene.csg = CsgExpression("a - b", {"a", "b"});
  const ImageComparison judged =
      compareImages(renderCpu(scene, kDataOnly), renderEmbree(scene, kDataOnly));
  EXPECT_TRUE(judged.agrees()) << judged.reason();
}

TEST(MeshScene, NeedsNoLevelSet) {
  Scene scene = leaningScene();
  scene.solids.clear();
  for (const Image& image : {renderCpu(scene, kDataOnly), renderEmbree(scene, kDataOnly)}) {
    const std::size_t middle = 45 * 120 + 60;
    EXPECT_EQ(image.ids.at("id")[middle], 2u);
    const V3d normal(static_cast<double>(image.channels.at("N.X")[middle]),
                     static_cast<double>(image.channels.at("N.Y")[middle]),
                     static_cast<double>(image.channels.at("N.Z")[middle]));
    EXPECT_LT((normal - V3d(-12, 0, 30).normalized()).length(), support::measured(5.83e-9));
    EXPECT_EQ(image.channels.at("curvature.mean")[middle], 0.0f);
  }
}

TEST(MeshScene, IsDrawnAloneIfTheExpressionIsEmpty) {
  Scene scene = leaningScene();
  scene.solids[0].band = {};
  scene.csg = CsgExpression("a", {"a"});
  const RenderOptions options = {.samples = 1, .ambientSamples = 1, .shadowSamples = 1};
  for (const Image& image : {renderCpu(scene, options), renderEmbree(scene, options)})
    EXPECT_EQ(image.ids.at("id")[45 * 120 + 60], 2u);
}

TEST(MeshScene, ExchangesShadowsWithLevelSets) {
  const auto brightnessOf = [](const Scene& scene, std::uint32_t id) {
    const RenderOptions options = {
        .samples = 1, .ambientSamples = 0, .shadowSamples = 4, .lightSpacing = 1};
    double sums[2] = {0, 0};
    for (int k = 0; k < 2; ++k) {
      const Image image = k == 0 ? renderCpu(scene, options) : renderEmbree(scene, options);
      for (std::size_t i = 0; i < image.pixelCount(); ++i)
        if (image.ids.at("id")[i] == id) sums[k] += static_cast<double>(image.channels.at("G")[i]);
    }
    EXPECT_NEAR(sums[0] / sums[1], 1, support::rounding(0.25));
    return sums[0];
  };
  const auto meshOf = [](const V3d& middle, const V3d& a, const V3d& b) {
    return std::make_shared<const levelset::TriMesh>(sheet(middle, a, b));
  };
  // Between the ball and the light, and outside the view.
  Scene ball = leaningScene();
  ball.meshes.clear();
  Scene shaded = ball;
  shaded.meshes.push_back({meshOf(V3d(0, 45, 0), V3d(80, 0, 0), V3d(0, 0, 80)), {}, 2, "roof"});
  EXPECT_LT(brightnessOf(shaded, 1), 0.9 * brightnessOf(ball, 1));
  // A sheet behind a ball, with the ball towards the light.
  Scene sheetAlone = leaningScene();
  sheetAlone.solids.clear();
  sheetAlone.meshes[0].mesh = meshOf(V3d(0), V3d(30, 0, 0), V3d(0, 25, 0));
  Scene shadedSheet = sheetAlone;
  shadedSheet.solids.push_back({.band = levelset::makeSphere(15, V3d(-40, 70, 60), 1)});
  EXPECT_LT(brightnessOf(shadedSheet, 2), 0.95 * brightnessOf(sheetAlone, 2));
}

TEST(MeshRays, UseNormalsAndColoursOfVertices) {
  levelset::TriMesh mesh = sheet(V3d(0), V3d(1, 0, 0), V3d(0, 1, 0));
  mesh.attributes.normals = {V3d(-1, 0, 1), V3d(1, 0, 1), V3d(1, 0, 1), V3d(-1, 0, 1)};
  mesh.attributes.colors = {Imath::V4f(1, 0, 0, 1), Imath::V4f(0, 0, 1, 1), Imath::V4f(0, 0, 1, 1),
                            Imath::V4f(1, 0, 0, 1)};
  Scene scene;
  scene.meshes.push_back({std::make_shared<const levelset::TriMesh>(mesh), {}, 7, "m"});
  const MeshRays rays(scene);
  for (const double x : {-0.8, 0.0, 0.5}) {
    const Hit hit = rays.intersect(V3d(x, 0.1, 5), V3d(0, 0, -1), 0, 100);
    ASSERT_TRUE(hit.found);
    EXPECT_NEAR(hit.distance, 5, support::doubleRounding(20));
    EXPECT_LT((hit.normal - V3d(x, 0, 1).normalized()).length(), support::rounding(1.25));
    EXPECT_EQ(hit.facetNormal, V3d(0, 0, 1));
    EXPECT_NEAR(hit.colour.x, std::pow(((1 - x) / 2 + 0.055) / 1.055, 2.4), support::rounding(2.5));
    EXPECT_EQ(hit.id, 7u);
    EXPECT_FALSE(rays.intersect(V3d(x, 0.1, 5), V3d(0, 0, -1), 0, 4.9).found);
    EXPECT_TRUE(rays.isOccluded(V3d(x, 0.1, 5), V3d(0, 0, -1), 5.1));
    EXPECT_FALSE(rays.isOccluded(V3d(x, 0.1, 5), V3d(0, 0, -1), 4.9));
  }
  EXPECT_FALSE(rays.intersect(V3d(3, 0, 5), V3d(0, 0, -1), 0, 100).found);
  EXPECT_TRUE(MeshRays(Scene()).isEmpty());
}

}  // namespace mesh_scene_test
