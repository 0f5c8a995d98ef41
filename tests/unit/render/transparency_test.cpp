// Transparent surfaces: their sum in closed form, and on all renderers.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "render/cpu/cpu_renderer.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/images/compare_images.h"
#include "tests/support/measured.h"
#include "tests/support/render_scenes.h"

namespace transparency_test {

using Imath::V3d;
using levelset::NarrowBand;
using namespace render;

/// Without rays to lights, a colour depends on the normal alone.
const RenderOptions kNoRays = {.samples = 1, .ambientSamples = 0, .shadowSamples = 0};
const RenderOptions kLit = {.samples = 2, .ambientSamples = 3, .shadowSamples = 2};

std::shared_ptr<const levelset::TriMesh> sheet(double z) {
  levelset::TriMesh mesh;
  mesh.positions = {{-30, -30, z}, {30, -30, z}, {30, 30, z}, {-30, 30, z}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return std::make_shared<const levelset::TriMesh>(mesh);
}

/// Slabs across the view along −z, from front to back.
Scene slabs(const std::vector<double>& opacities) {
  Scene scene;
  const Imath::C3f colours[] = {{0.7f, 0.2f, 0.1f}, {0.1f, 0.6f, 0.3f}, {0.2f, 0.3f, 0.8f}};
  for (std::size_t i = 0; i < opacities.size(); ++i)
    scene.solids.push_back(
        {.band = levelset::makeBox(V3d(60, 60, 4), V3d(0, 0, -12.0 * static_cast<double>(i)), 1),
         .colour = colours[i],
         .id = static_cast<std::uint32_t>(i + 1),
         .name = std::string(1, static_cast<char>('a' + i)),
         .opacity = opacities[i]});
  scene.camera.from = V3d(0, 0, 100);
  scene.camera.to = V3d(0);
  scene.camera.orthoHeight = 20;
  scene.camera.width = scene.camera.height = 16;
  return scene;
}

struct Seen {
  double r, g, b, a;
};

Seen middleOf(const Image& image) {
  const std::size_t i = image.pixelCount() / 2 + static_cast<std::size_t>(image.width / 2);
  const auto at = [&](const char* name) { return static_cast<double>(image.channels.at(name)[i]); };
  return {at("R"), at("G"), at("B"), at("A")};
}

/// Colours of that solid alone, opaque.
Seen aloneOf(Scene scene, std::size_t number) {
  Scene one = scene;
  one.meshes.clear();
  one.csg = {};
  one.solids = {scene.solids[number]};
  one.solids[0].opacity = 1;
  return middleOf(renderCpu(one, kNoRays));
}

Seen over(const Seen& front, double opacity, const Seen& back) {
  const double left = 1 - opacity;
  return {opacity * front.r + left * back.r, opacity * front.g + left * back.g,
          opacity * front.b + left * back.b, opacity + left * back.a};
}

void expectSeen(const Scene& scene, const Seen& wanted) {
  const Image cpu = renderCpu(scene, kNoRays);
  for (const Image& image : {cpu, renderEmbree(scene, kNoRays)}) {
    const Seen seen = middleOf(image);
    EXPECT_NEAR(seen.r, wanted.r, support::rounding(0.8));
    EXPECT_NEAR(seen.g, wanted.g, support::rounding(0.5));
    EXPECT_NEAR(seen.b, wanted.b, support::measured(1.16e-8));
    EXPECT_NEAR(seen.a, wanted.a, support::rounding(0.4));
  }
  EXPECT_EQ(compareImages(cpu, renderGpu(scene, kNoRays), {.exact = true}).differentBits, 0u);
}

TEST(Transparency, OfSlabsAddsUpFrontToBack) {
  const Scene scene = slabs({0.3, 0.6, 0.45});
  Seen wanted{0, 0, 0, 0};
  for (std::size_t i = 3; i-- > 0;)
    for (int side = 0; side < 2; ++side)  // each slab has a front and a back
      wanted = over(aloneOf(scene, i), scene.solids[i].opacity, wanted);
  EXPECT_NEAR(wanted.a, 1 - std::pow(0.7 * 0.4 * 0.55, 2), support::doubleRounding(1));
  expectSeen(scene, wanted);
}

TEST(Transparency, EndsAtOpaqueAndNearlyOpaqueSurfaces) {
  const Scene opaqueInside = slabs({0.3, 1, 0.45});
  const Seen front = aloneOf(opaqueInside, 0), back = aloneOf(opaqueInside, 1);
  expectSeen(opaqueInside, over(front, 1 - 0.7 * 0.7, back));
  const Scene dense = slabs({0.9, 0.9});  // a third surface would contribute less than 1/512
  const Seen first = aloneOf(dense, 0), second = aloneOf(dense, 1);
  Seen wanted = over(first, 1 - 0.1 * 0.1, over(second, 0.9, {0, 0, 0, 0}));
  EXPECT_NEAR(wanted.a, 1 - 1e-3, support::doubleRounding(4));
  expectSeen(dense, wanted);
}

TEST(Transparency, AppliesToTheSurfacesOfAnExpression) {
  // The slabs overlap. Their union has two surfaces, the slabs alone have four.
  Scene scene = slabs({0.3, 0.6});
  scene.solids[1].band = levelset::makeBox(V3d(60, 60, 4), V3d(0, 0, -2.2), 0.7);
  scene.csg = CsgExpression("a | b", {"a", "b"});
  const Seen a = aloneOf(scene, 0), b = aloneOf(scene, 1);
  expectSeen(scene, over(a, 0.3, over(b, 0.6, {0, 0, 0, 0})));
  scene.csg = CsgExpression("a & b", {"a", "b"});
  expectSeen(scene, over(b, 0.6, over(a, 0.3, {0, 0, 0, 0})));
  scene.csg = CsgExpression("a - b", {"a", "b"});
  expectSeen(scene, over(a, 0.3, over(b, 0.6, {0, 0, 0, 0})));
  scene.csg = {};
  expectSeen(scene, over(a, 0.3, over(b, 0.6, over(a, 0.3, over(b, 0.6, {0, 0, 0, 0})))));
}

TEST(Transparency, ShowsMeshesBehindSolidsAndSolidsBehindMeshes) {
  Scene scene = slabs({0.3, 0.6});
  scene.meshes.push_back({sheet(-6), {0.9f, 0.1f, 0.4f}, 5, "m"});
  Scene meshAlone = scene;
  meshAlone.solids.clear();
  const Seen mesh = middleOf(renderCpu(meshAlone, kNoRays)), a = aloneOf(scene, 0),
             b = aloneOf(scene, 1);
  const double slabA = 1 - 0.7 * 0.7, slabB = 1 - 0.4 * 0.4;
  expectSeen(scene, over(a, slabA, mesh));
  scene.meshes[0].opacity = 0.2;
  expectSeen(scene, over(a, slabA, over(mesh, 0.2, over(b, slabB, {0, 0, 0, 0}))));
  scene.meshes.push_back({sheet(20), {0.1f, 0.1f, 0.4f}, 6, "n", 0.5});
  meshAlone.meshes = {scene.meshes[1]};
  meshAlone.meshes[0].opacity = 1;
  const Seen front = middleOf(renderCpu(meshAlone, kNoRays));
  const Seen wanted = over(front, 0.5, over(a, slabA, over(mesh, 0.2, over(b, slabB, {}))));
  expectSeen(scene, wanted);
  scene.csg = CsgExpression("a | b", {"a", "b"});
  expectSeen(scene, wanted);
}

TEST(Transparency, RespectsTheDepthRange) {
  Scene scene = slabs({0.3, 0.6, 0.45});
  scene.camera.near = 100;  // inside the first slab
  scene.camera.far = 112;   // inside the second slab
  const Seen a = aloneOf(slabs({1}), 0), b = aloneOf(slabs({1, 1}), 1);
  expectSeen(scene, over(a, 0.3, over(b, 0.6, {0, 0, 0, 0})));
}

Scene ringsAroundABall() {
  Scene scene = support::sceneOf(support::rings());
  scene.solids[0].opacity = 0.35;
  scene.solids[0].name = "a";
  scene.solids.push_back({.band = levelset::makeSphere(15, V3d(3, 2, 4), 0.63),
                          .colour = {0.7f, 0.3f, 0.1f},
                          .id = 2,
                          .name = "b"});
  return scene;
}

TEST(Transparency, LeavesDataLayersToTheFirstSurface) {
  for (const char* csg : {"", "a | b", "b - a"}) {
    Scene scene = ringsAroundABall();
    if (*csg) scene.csg = CsgExpression(csg, {"a", "b"});
    const Image through = renderCpu(scene, kNoRays);
    scene.solids[0].opacity = 1;
    const Image opaque = renderCpu(scene, kNoRays);
    EXPECT_EQ(through.ids, opaque.ids);
    for (const auto& [name, values] : opaque.channels) {
      const bool isColour = name == "R" || name == "G" || name == "B" || name == "A";
      EXPECT_EQ(through.channels.at(name) == values, !isColour) << name;
    }
  }
}

/// Expects the judge's colours, except for samples on outlines, which belong to either side.
void expectColoursOfTheJudge(const Image& ours, const Image& judge, const char* what) {
  std::size_t unlike = 0;
  for (std::size_t i = 0; i < ours.pixelCount(); ++i) {
    bool isLike = true;
    for (const char* name : {"R", "G", "B", "A"})
      isLike = isLike && std::abs(ours.channels.at(name)[i] - judge.channels.at(name)[i]) < 1e-4f;
    unlike += !isLike;
  }
  EXPECT_LE(unlike, ours.pixelCount() / 1000) << what;
}

/// Expects the same light on average. Rays to lights start at different positions, so that single
/// pixels differ.
void expectSameLight(const Image& ours, const Image& judge, const char* what) {
  for (const char* name : {"R", "G", "B", "A"}) {
    double a = 0, b = 0;
    for (std::size_t i = 0; i < ours.pixelCount(); ++i) {
      a += static_cast<double>(ours.channels.at(name)[i]);
      b += static_cast<double>(judge.channels.at(name)[i]);
    }
    EXPECT_NEAR(a / b, 1, support::measured(2.17e-5)) << what << ' ' << name;
  }
}

TEST(Transparency, AgreesOnAllRenderers) {
  for (const char* csg : {"", "a | b", "a - b"}) {
    Scene scene = ringsAroundABall();
    if (*csg) scene.csg = CsgExpression(csg, {"a", "b"});
    for (const bool hasMesh : {false, true}) {
      if (hasMesh) scene.meshes.push_back({sheet(0), {0.3f, 0.3f, 0.6f}, 3, "m", 0.5});
      const Image lit = renderCpu(scene, kLit);
      EXPECT_EQ(compareImages(lit, renderGpu(scene, kLit), {.exact = true}).differentBits, 0u);
      expectColoursOfTheJudge(renderCpu(scene, kNoRays), renderEmbree(scene, kNoRays), csg);
      const RenderOptions shadowed = {.samples = 2, .ambientSamples = 0, .shadowSamples = 2};
      expectSameLight(renderCpu(scene, shadowed), renderEmbree(scene, shadowed), csg);
    }
  }
}

/// Brightness of the ground under a roof, seen from below the roof.
double brightnessUnder(const Scene& shaded, bool isJudge) {
  const RenderOptions options = {
      .samples = 1, .ambientSamples = 0, .shadowSamples = 4, .lightSpacing = 1};
  const Image image = isJudge ? renderEmbree(shaded, options) : renderCpu(shaded, options);
  double sum = 0;
  for (std::size_t i = 0; i < image.pixelCount(); ++i) {
    EXPECT_EQ(image.ids.at("id")[i], 1u);
    sum += static_cast<double>(image.channels.at("G")[i]);
  }
  return sum;
}

TEST(Transparency, DimsShadowsByTheTransmittedLight) {
  Scene ground = slabs({1});
  ground.key.direction = V3d(0, 1, 1);
  const auto withRoof = [&](double opacity, const char* csg) {
    Scene scene = ground;
    scene.solids.push_back({.band = levelset::makeBox(V3d(30, 4, 30), V3d(0, 18, 15), 1),
                            .id = 2,
                            .name = "b",
                            .opacity = opacity});
    if (*csg) scene.csg = CsgExpression(csg, {"a", "b"});
    return scene;
  };
  const auto withSheet = [&](double opacity) {
    Scene scene = ground;
    scene.camera.near = 90;  // beyond the sheet
    scene.meshes.push_back({sheet(20), {}, 2, "m", opacity});
    return scene;
  };
  for (const bool isJudge : {false, true}) {
    const double open = brightnessUnder(ground, isJudge);
    for (const char* csg : {"", "a | b"}) {
      const double dark = brightnessUnder(withRoof(1, csg), isJudge);
      EXPECT_LT(dark, 0.95 * open);
      EXPECT_NEAR(brightnessUnder(withRoof(0.3, csg), isJudge), dark + (open - dark) * 0.7 * 0.7,
                  support::measured(6.28e-8) * open);
    }
    const double dark = brightnessUnder(withSheet(1), isJudge);
    EXPECT_LT(dark, 0.95 * open);
    EXPECT_NEAR(brightnessUnder(withSheet(0.3), isJudge), dark + (open - dark) * 0.7,
                support::measured(1.07e-8) * open);
  }
}

TEST(Transparency, RefusesInvalidOpacities) {
  for (const double opacity : {0.0, -0.5, 1.5, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW((void)renderCpu(slabs({opacity}), kNoRays), levelset::UsageError);
    EXPECT_THROW((void)renderEmbree(slabs({opacity}), kNoRays), levelset::UsageError);
  }
}

}  // namespace transparency_test
