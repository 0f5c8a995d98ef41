// Soft CSG and morphs along each ray: comparison with the judge, scenes with meshes, and invalid
// scenes.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/transform.h"
#include "render/cpu/cpu_renderer.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/images/value_bits.h"
#include "render/kernel/kernel_scene.h"
#include "tests/support/field_scenes.h"
#include "tests/support/measured.h"
#include "tests/support/render_scenes.h"

namespace field_scene_test {

using namespace support::fields;

/// Grids of three resolutions, two of them rotated.
std::vector<NarrowBand> threeGrids() {
  const auto turn = [](const V3d& angles) { return Imath::M44d().rotate(angles); };
  return {
      levelset::makeSphere(20, V3d(0.1, 0.2, 0.3), 1, {.halfWidth = 4}),
      levelset::transform(levelset::makeBox(V3d(24, 18, 30), V3d(9, 7, 10), 0.61, {.halfWidth = 7}),
                          turn(V3d(0.3, 0.5, 0.2))),
      levelset::transform(
          levelset::makeTorus(14, 4, V3d(6, -8, 9), V3d(0, 0, 1), 0.37, {.halfWidth = 11}),
          turn(V3d(-0.4, 0.2, 0.7)))};
}

TEST(FieldJudge, AgreesOnThreeGrids) {
  for (const char* csg : {"a | b | c", "(a - b) | c"})
    expectJudged(blended(threeGrids(), csg, 2.5), csg);
  for (const char* csg : {"a & b - c", "(b | c) - a"})
    expectJudged(blended(threeGrids(), csg, 2.5, 160, 120), csg);
}

TEST(FieldJudge, AgreesFromInsideFromFarAndAlongTheSurface) {
  Scene scene = blended(threeGrids(), "(a | b) - c", 3);
  const Camera outside = scene.camera;
  scene.camera.from = V3d(0.3, 2.2, -3.1);
  scene.camera.to = V3d(20, 30, 11);
  expectJudged(scene, "from within");
  scene.camera = outside;
  scene.camera.from = outside.to + (outside.from - outside.to).normalized() * 1e5;
  scene.camera.verticalFov = 1.2 * scene.bounds().size().length() / 1e5;
  expectJudged(scene, "from far");
  // Slightly above the top of the ball.
  scene = blended({exactBall(V3d(0), 20, 1), exactBall(V3d(30, 0, 0), 14, 0.7)}, "a | b", 4);
  scene.camera.from = V3d(-60, 0.2, 20.02);
  scene.camera.to = V3d(60, 0.1, 20.05);
  scene.camera.up = V3d(0, 0, 1);
  expectJudged(scene, "grazing");
  expectJudged(morphed(threeGrids()[0], threeGrids()[2], 0.4, 320, 240), "morph");
}

TEST(FieldJudge, AgreesAlongTheLattice) {
  // Rays in faces and along edges of the cells of both grids.
  const NarrowBand box = levelset::makeBox(V3d(32, 24, 16), V3d(0), 1, {.halfWidth = 4}),
                   other = levelset::makeBox(V3d(12, 30, 8), V3d(8, 4, 6), 0.5, {.halfWidth = 8});
  for (const V3d& from : {V3d(0, 0, 60), V3d(0, 60, 0), V3d(60, 0, 0), V3d(-40, 50, 60)}) {
    Scene scene = support::alongTheLattice(box, from);
    const Camera camera = scene.camera;
    scene = blended({box, other}, "a | b", 2);
    scene.camera = camera;
    const Image ours = renderCpu(scene, kDataOnly), judge = renderEmbree(scene, kDataOnly);
    std::size_t unlike = 0, hits = 0;
    for (std::size_t i = 0; i < ours.pixelCount(); ++i) {
      const auto a = pixelOf(ours, i), b = pixelOf(judge, i);
      hits += a && b;
      unlike += a.has_value() != b.has_value() || (a && (a->place - b->place).length() > 1e-4);
    }
    EXPECT_GT(hits, 400u);
    EXPECT_EQ(unlike, 0u) << from;
  }
}

TEST(FieldJudge, AgreesOnNoise) {
  // Cells with several sheets each, and slopes far from 1.
  std::mt19937 random(5);
  std::uniform_real_distribution<double> even(-1, 1);
  const NarrowBand noise = support::sampleBand(
      [&](const V3d& p) {
        const double value = even(random);
        return p.length() < 9 ? value : 4;
      },
      Imath::Box3d(V3d(-10), V3d(10)), 1);
  for (const char* csg : {"a | b", "b - a"}) {
    const Scene scene =
        blended({noise, levelset::makeSphere(8, V3d(3, 2, 1), 0.7)}, csg, 0.8, 160, 120);
    const Image ours = renderCpu(scene, kDataOnly), judge = renderEmbree(scene, kDataOnly);
    std::size_t both = 0, unlike = 0;
    for (std::size_t i = 0; i < ours.pixelCount(); ++i) {
      const auto a = pixelOf(ours, i), b = pixelOf(judge, i);
      both += a && b;
      unlike += a.has_value() != b.has_value() || (a && (a->place - b->place).length() > 1e-4);
    }
    EXPECT_GT(both, 1500u) << csg;
    EXPECT_EQ(unlike, 0u) << csg;
  }
}

TEST(FieldJudge, AgreesInThicknessAndShadows) {
  RenderOptions options = kDataOnly;
  options.thickness = true;
  Scene scene = blended(threeGrids(), "(a | b) - c", 3, 160, 120);
  const ImageComparison found =
      compareImages(renderCpu(scene, options), renderEmbree(scene, options));
  EXPECT_TRUE(found.agrees()) << found.reason();
  // The hollow of a ball minus a capsule is dark in both pictures.
  options = {.samples = 1, .ambientSamples = 32, .shadowSamples = 4};
  scene = blended({levelset::makeSphere(20, V3d(0), 1),
                   levelset::makeCapsule(V3d(0, 0, -5), V3d(0, 0, 40), 5, 0.7, {.halfWidth = 5})},
                  "a - b", 2, 96, 72);
  scene.camera.from = V3d(0, 0, 100);
  scene.camera.to = V3d(0);
  const Image cpu = renderCpu(scene, options), judge = renderEmbree(scene, options);
  const auto lightAt = [](const Image& image, int x, int y) {
    const std::size_t i = static_cast<std::size_t>(y) * 96 + static_cast<std::size_t>(x);
    return static_cast<double>(image.channels.at("R")[i] + image.channels.at("G")[i]);
  };
  std::size_t unlike = 0;  // rays to the light that graze the surface
  for (int y = 0; y < 72; ++y)
    for (int x = 0; x < 96; ++x)
      unlike += std::abs(lightAt(cpu, x, y) - lightAt(judge, x, y)) > 1e-3;
  EXPECT_LE(unlike, cpu.pixelCount() / 200);
  EXPECT_LT(lightAt(cpu, 48, 36), 0.5 * lightAt(cpu, 48, 22));
}

/// A ball of radius 20 about the origin as a morph half way between two others, seen along −z from
/// 100.
Scene halfWayBall(double near, std::optional<double> far) {
  Scene scene = morphed(exactBall(V3d(0), 19.5, 0.5, 10), exactBall(V3d(0), 20.5, 0.4, 12), 0.5);
  scene.camera.from = V3d(0, 0, 100);
  scene.camera.to = V3d(0);
  scene.camera.orthoHeight = 50;
  scene.camera.near = near;
  scene.camera.far = far;
  return scene;
}

TEST(FieldDepths, CutABallAtTheirPlanes) {
  struct Depths {
    double near;
    std::optional<double> far;
  };
  RenderOptions options = kDataOnly;
  options.thickness = true;
  for (const auto& [near, far] :
       {Depths{0, {}}, {90, {}}, {100, {}}, {0, 90}, {88, 112}, {97, 103}, {121, {}}, {0, 79}}) {
    const Scene scene = halfWayBall(near, far);
    for (const Image& image : {renderCpu(scene, options), renderEmbree(scene, options)})
      for (std::size_t i = 0; i < image.pixelCount(); ++i) {
        const double x = (static_cast<double>(i % 160) + 0.5 - 80) * 50 / 120,
                     y = (static_cast<double>(i / 160) + 0.5 - 60) * 50 / 120, r2 = x * x + y * y;
        if (std::abs(r2 - 400) < 20) continue;
        const double half = r2 < 400 ? std::sqrt(400 - r2) : 0, in = 100 - half, out = 100 + half,
                     end = far.value_or(1e9);
        // On a plane both results are correct.
        if (std::min(std::min(std::abs(in - near), std::abs(in - end)),
                     std::min(std::abs(out - near), std::abs(out - end))) < 0.1)
          continue;
        const bool seesFront = half > 0 && in > near && in<end, seesBack = half> 0 && in < near &&
                               out > near && out < end;
        ASSERT_NEAR(image.channels.at("thickness")[i],
                    std::max(0.0, std::min(out, end) - std::max(in, near)),
                    support::measured(0.0171))
            << near << ' ' << r2;
        const auto pixel = pixelOf(image, i);
        ASSERT_EQ(pixel.has_value(), seesFront || seesBack) << near << ' ' << r2;
        if (!pixel) continue;
        ASSERT_NEAR(image.channels.at("Z")[i], seesFront ? in : out, support::measured(0.00853));
        // The normal points outwards and the surface is convex, as from outside.
        ASSERT_NEAR(pixel->normal.z, (seesFront ? half : -half) / 20, support::measured(4.04e-4));
        ASSERT_NEAR(image.channels.at("curvature.mean")[i], 0.05, support::measured(7.09e-6));
      }
  }
}

TEST(FieldDepths, AgreeWithTheJudge) {
  for (const bool isOrtho : {false, true}) {
    Scene scene = blended(threeGrids(), "(a | b) - c", 3, 160, 120);
    const double away = (scene.camera.to - scene.camera.from).length();
    if (isOrtho) scene.camera.orthoHeight = 70;
    for (const auto& [near, far] : {std::pair{0.9, 2.0}, {1.0, 1.2}, {0.0, 1.0}, {0.8, 0.95}}) {
      scene.camera.near = near * away;
      scene.camera.far = far * away;
      expectJudged(scene, "depths");
      RenderOptions options = kDataOnly;
      options.thickness = true;
      const Image ours = renderCpu(scene, options);
      const ImageComparison found = compareImages(ours, renderEmbree(scene, options));
      EXPECT_TRUE(found.agrees()) << found.reason();
      for (const float z : ours.channels.at("Z")) {
        if (!std::isfinite(z)) continue;
        ASSERT_GE(z, scene.camera.near * (1 - 1e-6));
        ASSERT_LE(z, *scene.camera.far * (1 + 1e-6));
      }
    }
  }
}

TEST(FieldDepths, DoNotChangeShadows) {
  // A roof before the near plane, between the ball and the light.
  const NarrowBand ball = levelset::makeSphere(20, V3d(0), 1),
                   roof = levelset::makeBox(V3d(80, 80, 4), V3d(0, 30, 50), 1);
  for (const auto& draw : {renderCpu, renderEmbree}) {
    double sums[2];
    for (const bool hasRoof : {false, true}) {
      Scene scene = blended({ball, roof}, hasRoof ? "a | b" : "a", 1, 160, 120);
      scene.camera = halfWayBall(79, {}).camera;
      const Image image =
          draw(scene, {.samples = 1, .ambientSamples = 0, .shadowSamples = 4, .lightSpacing = 1});
      double& sum = sums[hasRoof ? 1 : 0] = 0;
      for (std::size_t i = 0; i < image.pixelCount(); ++i) {
        EXPECT_NE(image.ids.at("id")[i], 2u);
        sum += static_cast<double>(image.channels.at("R")[i]);
      }
    }
    EXPECT_LT(sums[1], 0.8 * sums[0]);
  }
}

std::shared_ptr<const levelset::TriMesh> sheet(double z) {
  levelset::TriMesh mesh;
  mesh.positions = {{-90, -90, z}, {90, -90, z}, {90, 90, z}, {-90, 90, z}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return std::make_shared<const levelset::TriMesh>(mesh);
}

TEST(FieldScene, IsSeenThroughMeshesAndHidesThem) {
  const std::size_t middle = 60 * 160 + 80;
  const char* const colours[] = {"R", "G", "B", "A"};
  const Scene ball = halfWayBall(0, {});
  Scene meshAlone = ball;
  meshAlone.solids.clear();
  meshAlone.morph.reset();
  meshAlone.meshes = {{sheet(30), {0.1f, 0.2f, 0.7f}, 3, "front"}};
  const Image ofBall = renderCpu(ball, kDataOnly), ofMesh = renderCpu(meshAlone, kDataOnly);
  // In front, inside and behind.
  Scene scene = ball;
  for (const double z : {30.0, 0.0, -30.0}) {
    scene.meshes = {{sheet(z), {0.1f, 0.2f, 0.7f}, 3, "sheet", 0.4}};
    for (const Image& image : {renderCpu(scene, kDataOnly), renderEmbree(scene, kDataOnly)}) {
      EXPECT_EQ(image.ids.at("id")[middle], z > 20 ? 3u : 1u);
      for (const char* name : colours) {
        const float share = z > 20 ? 0.4f : 0;
        EXPECT_NEAR(image.channels.at(name)[middle],
                    share * ofMesh.channels.at(name)[middle] +
                        (1 - share) * ofBall.channels.at(name)[middle],
                    support::rounding(1));
      }
    }
  }
  // The near plane cuts the ball's front, lies inside the ball, and lies behind the wall that is
  // visible from inside.
  scene.camera.near = 95;
  scene.meshes = {{sheet(20), {}, 3, "cut", 0.4},
                  {sheet(2), {0.1f, 0.2f, 0.7f}, 4, "within", 0.4},
                  {sheet(-30), {}, 5, "behind", 0.4}};
  RenderOptions lit = {.samples = 2, .ambientSamples = 3, .shadowSamples = 2};
  for (const RenderOptions& options : {kDataOnly, lit}) {
    const Image cpu = renderCpu(scene, options), judge = renderEmbree(scene, options);
    EXPECT_EQ(cpu.ids.at("id")[middle], 4u);
    EXPECT_NEAR(cpu.channels.at("A")[middle], 1, support::rounding(1));
    for (const char* name : colours) {
      std::size_t unlike = 0;
      double ours = 0, theirs = 0;
      for (std::size_t i = 0; i < cpu.pixelCount(); ++i) {
        const float a = cpu.channels.at(name)[i], b = judge.channels.at(name)[i];
        unlike += std::abs(a - b) > 1e-4f;
        ours += static_cast<double>(a);
        theirs += static_cast<double>(b);
      }
      EXPECT_NEAR(ours, theirs, support::measured(1.18e-9) * theirs) << name;
      EXPECT_TRUE(options.shadowSamples > 0 || unlike <= cpu.pixelCount() / 1000)
          << name << ": " << unlike;
    }
  }
}

TEST(FieldScene, IsLitThroughMeshes) {
  // A sheet between the light and the ball transmits its share of the light.
  for (const auto& draw : {renderCpu, renderEmbree}) {
    const auto brightness = [&](double opacity) {
      Scene scene = halfWayBall(65, {});
      if (opacity > 0) scene.meshes = {{sheet(40), {}, 3, "roof", opacity}};
      const Image image =
          draw(scene, {.samples = 1, .ambientSamples = 0, .shadowSamples = 4, .lightSpacing = 1});
      double sum = 0;
      for (const float r : image.channels.at("R")) sum += static_cast<double>(r);
      return sum;
    };
    const double open = brightness(0), dark = brightness(1);
    EXPECT_LT(dark, 0.95 * open);
    EXPECT_NEAR(brightness(0.3), dark + (open - dark) * 0.7, support::measured(1.65e-9) * open);
  }
}

TEST(FieldScene, RejectsOpacity) {
  Scene scene = halfWayBall(0, {});
  scene.solids[1].opacity = 0.5;
  for (const auto& draw : {renderCpu, renderEmbree, renderGpu})
    EXPECT_THROW((void)draw(scene, kDataOnly), levelset::UsageError);
}

TEST(FieldScene, BothRenderersUseValuesOfFewBits) {
  for (const int bits : {16, 8})
    for (const bool isMorph : {false, true}) {
      Scene scene = isMorph ? morphed(threeGrids()[0], threeGrids()[2], 0.4)
                            : blended(threeGrids(), "(a | b) - c", 2.5, 160, 120);
      const Image whole = renderCpu(scene, kDataOnly);
      double step = 0;
      for (Solid& solid : scene.solids) {
        QuantizedBand coarse = quantized(solid.band, bits);
        solid.band = std::move(coarse.band);
        solid.quantization = coarse.quantization;
        step = std::max(step, static_cast<double>(coarse.quantization.step));
      }
      expectJudged(scene, std::to_string(bits) + " bits");
      const Image image = renderCpu(scene, kDataOnly);
      EXPECT_EQ(image.attributes.at("ls:valueBits").substr(0, 2), bits == 16 ? "16" : "8,");
      std::size_t moved = 0, both = 0;
      for (std::size_t i = 0; i < image.pixelCount(); ++i) {
        const auto a = pixelOf(image, i), b = pixelOf(whole, i);
        if (!a || !b) continue;
        ++both;
        moved += std::abs((a->place - b->place).dot(b->normal)) > step;
      }
      EXPECT_GT(both, 1000u);
      EXPECT_LE(moved, both / 100);
    }
}

TEST(FieldScene, UsesTheNormalsOfTheFinerGrid) {
  // A coarse ball with a fine bump. The normals of the bump are as accurate as without the ball.
  const NarrowBand coarse = exactBall(V3d(0), 20, 2, 3),
                   fine = exactBall(V3d(0, 0, 20), 3, 0.2, 10);
  Scene scene = blended({coarse, fine}, "a | b", 1.5, 160, 120);
  scene.camera.from = V3d(0, 0, 60);
  scene.camera.to = V3d(0, 0, 20);
  scene.camera.orthoHeight = 5;
  const Image image = renderCpu(scene, kDataOnly);
  std::size_t seen = 0;
  for (std::size_t i = 0; i < image.pixelCount(); ++i) {
    const auto pixel = pixelOf(image, i);
    ASSERT_TRUE(pixel);
    if (pixel->place.z < 22) continue;
    ++seen;
    EXPECT_EQ(image.ids.at("id")[i], 2u);
    ASSERT_GT(pixel->normal.dot((pixel->place - V3d(0, 0, 20)).normalized()), 1 - 1e-6);
  }
  EXPECT_GT(seen, 5000u);
}

TEST(FieldScene, RefusesInvalidScenes) {
  const NarrowBand ball = levelset::makeSphere(8, V3d(0), 1),
                   fine = levelset::makeSphere(8, V3d(9, 0, 0), 0.5);
  EXPECT_NO_THROW((void)renderCpu(blended({ball, fine}, "a | b", 1.4, 8, 8), kDataOnly));
  // Five nested smoothing steps may subtract up to 5/4 K from the 1.5 of the narrower band.
  EXPECT_THROW(
      (void)renderCpu(blended({ball, fine}, "a | b | a | b | a | b", 1.4, 8, 8), kDataOnly),
      levelset::InvalidInput);
  for (const auto& draw : {renderCpu, renderEmbree, renderGpu}) {
    EXPECT_THROW((void)draw(blended({ball, fine}, "a | b", 1.6, 8, 8), kDataOnly),
                 levelset::InvalidInput);
    EXPECT_THROW((void)draw(blended({ball, fine}, "", 1, 8, 8), kDataOnly), levelset::UsageError);
    EXPECT_THROW((void)draw(blended({ball, fine}, "a | b", NAN, 8, 8), kDataOnly),
                 levelset::UsageError);
    EXPECT_THROW((void)draw(morphed(ball, fine, 1.1, 8, 8), kDataOnly), levelset::UsageError);
    Scene scene = blended({ball, fine, ball}, "", 0, 8, 8);
    scene.morph = 0.5;
    EXPECT_THROW((void)draw(scene, kDataOnly), levelset::UsageError);
    RenderOptions spline = kDataOnly;
    spline.filter = Filter::BSplineQi;
    EXPECT_THROW((void)draw(morphed(ball, fine, 0.5, 8, 8), spline), levelset::UsageError);
  }
}

TEST(KernelScene, EvaluatesTheFinerGridFirst) {
  Scene scene = blended({levelset::makeSphere(8, V3d(0), 1), levelset::makeSphere(8, V3d(0), 0.5),
                         levelset::makeSphere(8, V3d(0), 1)},
                        "", 0, 8, 8);
  scene.solids[0].id = 7;
  const KernelScene surfaces(scene);
  ASSERT_EQ(surfaces.solids().size(), 3u);
  EXPECT_EQ(surfaces.solids()[0].id, 2u);
  EXPECT_EQ(surfaces.solids()[1].id, 3u);
  EXPECT_EQ(surfaces.solids()[2].id, 7u);
}

}  // namespace field_scene_test
