// Soft CSG and morphs along each ray: against closed forms, the solids alone, and the judge.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "levelset/solids/shapes.h"
#include "levelset/solids/transform.h"
#include "render/compare_images.h"
#include "render/cpu/cpu_renderer.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/kernel/kernel_scene.h"
#include "render/value_bits.h"
#include "tests/support/bands.h"
#include "tests/support/render_scenes.h"

namespace field_scene_test {

using Imath::V3d;
using levelset::NarrowBand;
using namespace render;

const RenderOptions kDataOnly = {.samples = 1, .ambientSamples = 0, .shadowSamples = 0};

Scene blended(const std::vector<NarrowBand>& bands, const std::string& csg, double softness,
              int width = 320, int height = 240) {
  Scene scene;
  std::vector<std::string> names;
  for (const NarrowBand& band : bands) {
    names.emplace_back(1, static_cast<char>('a' + names.size()));
    scene.solids.push_back(
        {.band = band,
         .colour = names.size() == 1 ? Imath::C3f(0.6f, 0, 0) : Imath::C3f(0, 0.6f, 0),
         .id = static_cast<std::uint32_t>(names.size()),
         .name = names.back()});
  }
  if (!csg.empty()) scene.csg = CsgExpression(csg, names);
  scene.softness = softness;
  scene.camera = framingCamera(scene.bounds(), width, height);
  return scene;
}

Scene morphed(const NarrowBand& a, const NarrowBand& b, double share, int width = 160,
              int height = 120) {
  Scene scene = blended({a, b}, "", 0, width, height);
  scene.morph = share;
  return scene;
}

/// Sampled from a formula, in a wide band.
NarrowBand exactBall(const V3d& centre, double radius, double voxel, double halfWidth = 6) {
  const V3d reach(radius + halfWidth * voxel);
  return support::sampleBand([&](const V3d& p) { return (p - centre).length() - radius; },
                             Imath::Box3d(centre - reach, centre + reach), voxel, halfWidth);
}

struct Pixel {
  V3d place, normal;
};

std::optional<Pixel> pixelOf(const Image& image, std::size_t i) {
  if (!std::isfinite(image.channels.at("Z")[i])) return std::nullopt;
  const auto read = [&](const char* layer) {
    const auto at = [&](const char* axis) {
      return static_cast<double>(image.channels.at(std::string(layer) + axis)[i]);
    };
    return V3d(at(".X"), at(".Y"), at(".Z"));
  };
  return Pixel{read("P"), read("N")};
}

/// The bounds of Agreement.*, in voxels of the finest grid.
void expectJudged(const Scene& scene, const std::string& what) {
  const Image ours = renderCpu(scene, kDataOnly), judge = renderEmbree(scene, kDataOnly);
  const ImageComparison found = compareImages(ours, judge);
  EXPECT_TRUE(found.agrees()) << what << ": " << found.reason();
  EXPECT_GT(found.bothHit, found.pixels / 50) << what;
  EXPECT_EQ(found.unlikeElsewhere, 0u) << what;
  EXPECT_LE(static_cast<double>(found.unlikeAtOutline), 1e-5 * static_cast<double>(found.pixels))
      << what;
  double voxel = HUGE_VAL;
  for (const Solid& solid : scene.solids) voxel = std::min(voxel, solid.band.voxelSize());
  std::size_t compared = 0, beyond = 0, turned = 0;
  for (std::size_t i = 0; i < ours.pixelCount(); ++i) {
    const auto a = pixelOf(ours, i), b = pixelOf(judge, i);
    if (!a || !b) continue;
    ++compared;
    // Places are floats.
    beyond += (a->place - b->place).length() > 1e-3 * voxel + 1e-6 * a->place.length();
    turned += 2 * std::asin(std::min(1.0, (a->normal - b->normal).length() / 2)) >
              0.1 * std::numbers::pi / 180;
  }
  EXPECT_LE(static_cast<double>(beyond), 1e-4 * static_cast<double>(compared)) << what;
  EXPECT_LE(static_cast<double>(turned), 1e-4 * static_cast<double>(compared)) << what;
}

/// Two balls of 8 and 6, joined softly: value and gradient in closed form.
struct TwoBalls {
  V3d a{0.13, 0.27, 0.31}, b{11.2, 2.4, 1.7};
  double radiusA = 8, radiusB = 6, softness = 3;

  [[nodiscard]] double phi(const V3d& p, V3d& gradient) const {
    const V3d toA = p - a, toB = p - b;
    const double u = toA.length() - radiusA, v = toB.length() - radiusB;
    const double overlap = std::max(softness - std::abs(u - v), 0.0);
    const double later = overlap / (2 * softness);  // the share of the larger one
    const double shareOfA = u < v ? 1 - later : later;
    gradient = toA.normalized() * shareOfA + toB.normalized() * (1 - shareOfA);
    return std::min(u, v) - overlap * overlap / (4 * softness);
  }
};

TEST(SoftCsg, OfBallsGoesToTheClosedFormWithTheSecondOrder) {
  // Derivatives read up to three voxels beyond where the fields blend.
  const TwoBalls exact;
  for (const bool isJudge : {false, true}) {
    std::vector<double> depths, normals;
    for (const double voxel : {1.0, 0.5, 0.25}) {
      const Scene scene = blended({exactBall(exact.a, exact.radiusA, voxel, 3 / voxel + 4),
                                   exactBall(exact.b, exact.radiusB, voxel, 3 / voxel + 4)},
                                  "a | b", exact.softness, 160, 120);
      const Image image = isJudge ? renderEmbree(scene, kDataOnly) : renderCpu(scene, kDataOnly);
      double deepest = 0, turned = 0;
      std::size_t hits = 0, joint = 0;
      for (std::size_t i = 0; i < image.pixelCount(); ++i) {
        const auto pixel = pixelOf(image, i);
        if (!pixel) continue;
        V3d gradient;
        deepest = std::max(deepest, std::abs(exact.phi(pixel->place, gradient)));
        turned = std::max(turned, (pixel->normal - gradient.normalized()).length());
        ++hits;
        joint += image.channels.at("curvature.k2")[i] < -0.02f;  // the saddle between them
      }
      EXPECT_GT(hits, 3000u);
      EXPECT_GT(joint, 100u);
      EXPECT_FALSE(image.attributes.contains("ls:warning"));
      depths.push_back(deepest);
      normals.push_back(turned);
    }
    for (const auto& errors : {depths, normals})
      for (std::size_t n = 1; n < errors.size(); ++n)
        EXPECT_GT(std::log2(errors[n - 1] / errors[n]), 1.7)
            << errors[n - 1] << " to " << errors[n] << (isJudge ? ", judge" : "");
    EXPECT_LT(depths.back(), 0.01);
  }
}

TEST(SoftCsg, BridgesAGapWhereNeitherSolidIs) {
  // 1 apart: the smooth minimum in the middle is 0.5 − K/4.
  const NarrowBand a = levelset::makeSphere(10, V3d(-10.5, 0, 0), 0.5, {.halfWidth = 8}),
                   b = levelset::makeSphere(10, V3d(10.5, 0, 0), 0.31, {.halfWidth = 13});
  for (const double softness : {1.6, 3.6}) {
    Scene scene = blended({a, b}, "a | b", softness, 161, 121);
    scene.camera.from = V3d(0, 0, 60);
    scene.camera.to = V3d(0);
    const Image cpu = renderCpu(scene, kDataOnly), judge = renderEmbree(scene, kDataOnly);
    const std::size_t middle = 60 * 161 + 80;
    for (const Image* image : {&cpu, &judge}) {
      const auto pixel = pixelOf(*image, middle);
      ASSERT_EQ(pixel.has_value(), softness > 2);
      if (!pixel) continue;
      // √(10.5² + z²) − 10 = K/4
      EXPECT_NEAR(pixel->place.z, std::sqrt(std::pow(10 + 0.25 * softness, 2) - 10.5 * 10.5), 0.05);
      EXPECT_NEAR(pixel->normal.z, 1, 1e-3);
      EXPECT_LT(image->channels.at("curvature.k2")[middle], -0.1f);
      // Of both colours alike.
      EXPECT_NEAR(image->channels.at("R")[middle] / image->channels.at("G")[middle], 1, 0.2);
    }
    EXPECT_TRUE(compareImages(cpu, judge).agrees()) << compareImages(cpu, judge).reason();
  }
}

TEST(SoftCsg, GoesToHardCsgWhereNothingIsSoft) {
  const NarrowBand ball = levelset::makeSphere(20, V3d(0.1, 0.2, 0.3), 1),
                   box = levelset::makeBox(V3d(24), V3d(8.1, 6.3, 9.2), 0.61);
  for (const char* csg : {"a | b", "a & b", "a - b", "b - a"}) {
    const Scene hard = blended({ball, box}, csg, 0, 160, 120);
    const Image sharp = renderCpu(hard, kDataOnly);
    double before = HUGE_VAL;
    for (const double softness : {1.8, 0.2, 1e-6}) {
      Scene scene = hard;
      scene.softness = softness;
      const Image soft = renderCpu(scene, kDataOnly);
      std::size_t both = 0, unlike = 0;
      double sum = 0;
      for (std::size_t i = 0; i < soft.pixelCount(); ++i) {
        const auto p = pixelOf(soft, i), q = pixelOf(sharp, i);
        unlike += p.has_value() != q.has_value();
        if (!p || !q) continue;
        ++both;
        sum += std::min(1.0, (p->place - q->place).length());
        if (softness < 1e-3) unlike += (p->place - q->place).length() > 2e-4;
      }
      ASSERT_GT(both, 1000u) << csg;
      EXPECT_TRUE(softness > 1e-3 || unlike <= both / 1000) << csg << ": " << unlike;
      EXPECT_LT(sum, before) << csg << " at " << softness;
      before = sum;
    }
  }
}

TEST(Morph, BeginsAndEndsAtTheSolids) {
  const NarrowBand ball = levelset::makeSphere(12, V3d(0.1, 0.2, 0.3), 0.7),
                   rings = support::rings();
  for (const bool isEnd : {false, true}) {
    const Scene scene = morphed(ball, rings, isEnd ? 1 : 0);
    Scene alone = scene;
    alone.morph.reset();
    alone.solids.erase(alone.solids.begin() + (isEnd ? 0 : 1));
    const ImageComparison found =
        compareImages(renderCpu(scene, kDataOnly), renderCpu(alone, kDataOnly));
    EXPECT_TRUE(found.agrees()) << found.reason();
    EXPECT_GT(found.bothHit, 500u);
    const ImageComparison judged =
        compareImages(renderEmbree(scene, kDataOnly), renderEmbree(alone, kDataOnly));
    EXPECT_TRUE(judged.agrees()) << judged.reason();
  }
}

TEST(Morph, OfBallsAboutOneMiddleIsABall) {
  const double voxel = 0.25;
  for (const double share : {0.25, 0.5, 0.8}) {
    const double radius = 8 + share;
    const Scene scene = morphed(exactBall(V3d(0.1, 0.2, 0.3), 8, voxel, 8),
                                exactBall(V3d(0.1, 0.2, 0.3), 9, 0.8 * voxel, 8), share);
    for (const Image& image : {renderCpu(scene, kDataOnly), renderEmbree(scene, kDataOnly)}) {
      std::size_t hits = 0;
      for (std::size_t i = 0; i < image.pixelCount(); ++i) {
        const auto pixel = pixelOf(image, i);
        if (!pixel) continue;
        ++hits;
        const V3d away = pixel->place - V3d(0.1, 0.2, 0.3);
        ASSERT_NEAR(away.length(), radius, 0.26 * voxel * voxel / radius + 1e-4);
        ASSERT_NEAR(pixel->normal.dot(away.normalized()), 1, 1e-6);
        ASSERT_NEAR(image.channels.at("curvature.mean")[i], 1 / radius, 2e-4);
      }
      EXPECT_GT(hits, 3000u);
      EXPECT_FALSE(image.attributes.contains("ls:warning"));
    }
  }
}

TEST(Morph, TellsWhereTheBandsEnd) {
  // 10 apart in bands of 3: in between neither knows how far it is.
  const Scene scene =
      morphed(levelset::makeSphere(10, V3d(0), 1), levelset::makeSphere(20, V3d(0), 1), 0.3);
  for (const Image& image : {renderCpu(scene, kDataOnly), renderEmbree(scene, kDataOnly)}) {
    ASSERT_TRUE(image.attributes.contains("ls:warning"));
    EXPECT_NE(image.attributes.at("ls:warning").find("widen the bands"), std::string::npos);
  }
}

/// Grids of three resolutions, two of them turned.
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

TEST(FieldJudge, AgreesFromWithinFromFarAndAlongTheSurface) {
  Scene scene = blended(threeGrids(), "(a | b) - c", 3);
  const Camera outside = scene.camera;
  scene.camera.from = V3d(0.3, 2.2, -3.1);
  scene.camera.to = V3d(20, 30, 11);
  expectJudged(scene, "from within");
  scene.camera = outside;
  scene.camera.from = outside.to + (outside.from - outside.to).normalized() * 1e5;
  scene.camera.verticalFov = 1.2 * scene.bounds().size().length() / 1e5;
  expectJudged(scene, "from far");
  // Just above the ball's top.
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
  // Cells that hold several sheets each, and slopes far from 1.
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
  // Of a ball that a capsule is taken from, the hollow is dark, in the one as in the other.
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
  std::size_t unlike = 0;  // a ray to the light that grazes
  for (int y = 0; y < 72; ++y)
    for (int x = 0; x < 96; ++x)
      unlike += std::abs(lightAt(cpu, x, y) - lightAt(judge, x, y)) > 1e-3;
  EXPECT_LE(unlike, cpu.pixelCount() / 200);
  EXPECT_LT(lightAt(cpu, 48, 36), 0.5 * lightAt(cpu, 48, 22));
}

/// A ball of radius 20 about the origin, half way between two others, seen along −z from 100.
Scene halfWayBall(double near, std::optional<double> far) {
  Scene scene = morphed(exactBall(V3d(0), 19.5, 0.5, 10), exactBall(V3d(0), 20.5, 0.4, 12), 0.5);
  scene.camera.from = V3d(0, 0, 100);
  scene.camera.to = V3d(0);
  scene.camera.orthoHeight = 50;
  scene.camera.near = near;
  scene.camera.far = far;
  return scene;
}

TEST(FieldDepths, CutABallBetweenTheirPlanes) {
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
        // On a plane either is right.
        if (std::min(std::min(std::abs(in - near), std::abs(in - end)),
                     std::min(std::abs(out - near), std::abs(out - end))) < 0.1)
          continue;
        const bool seesFront = half > 0 && in > near && in<end, seesBack = half> 0 && in < near &&
                               out > near && out < end;
        ASSERT_NEAR(image.channels.at("thickness")[i],
                    std::max(0.0, std::min(out, end) - std::max(in, near)), 0.05)
            << near << ' ' << r2;
        const auto pixel = pixelOf(image, i);
        ASSERT_EQ(pixel.has_value(), seesFront || seesBack) << near << ' ' << r2;
        if (!pixel) continue;
        ASSERT_NEAR(image.channels.at("Z")[i], seesFront ? in : out, 0.02);
        // Outwards, and convex, as from without.
        ASSERT_NEAR(pixel->normal.z, (seesFront ? half : -half) / 20, 1e-3);
        ASSERT_NEAR(image.channels.at("curvature.mean")[i], 0.05, 1e-3);
      }
  }
}

TEST(FieldDepths, AreJudged) {
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

TEST(FieldDepths, LeaveShadowsAsTheyAre) {
  // A roof before the near plane, between the ball and the light.
  const NarrowBand ball = levelset::makeSphere(20, V3d(0), 1),
                   roof = levelset::makeBox(V3d(80, 80, 4), V3d(0, 30, 50), 1);
  for (const auto& draw : {renderCpu, renderEmbree}) {
    double sums[2];
    for (const bool hasRoof : {false, true}) {
      Scene scene = blended({ball, roof}, hasRoof ? "a | b" : "a", 1, 160, 120);
      scene.camera = halfWayBall(79, {}).camera;
      const Image image = draw(scene, {.samples = 1, .ambientSamples = 0, .shadowSamples = 4});
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
  // In front, within and behind.
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
                    1e-5);
      }
    }
  }
  // Cut off with the ball's front; within the ball; behind the wall that is seen from within.
  scene.camera.near = 95;
  scene.meshes = {{sheet(20), {}, 3, "cut", 0.4},
                  {sheet(2), {0.1f, 0.2f, 0.7f}, 4, "within", 0.4},
                  {sheet(-30), {}, 5, "behind", 0.4}};
  RenderOptions lit = {.samples = 2, .ambientSamples = 3, .shadowSamples = 2};
  for (const RenderOptions& options : {kDataOnly, lit}) {
    const Image cpu = renderCpu(scene, options), judge = renderEmbree(scene, options);
    EXPECT_EQ(cpu.ids.at("id")[middle], 4u);
    EXPECT_NEAR(cpu.channels.at("A")[middle], 1, 1e-6);
    for (const char* name : colours) {
      std::size_t unlike = 0;
      double ours = 0, theirs = 0;
      for (std::size_t i = 0; i < cpu.pixelCount(); ++i) {
        const float a = cpu.channels.at(name)[i], b = judge.channels.at(name)[i];
        unlike += std::abs(a - b) > 1e-4f;
        ours += static_cast<double>(a);
        theirs += static_cast<double>(b);
      }
      EXPECT_NEAR(ours, theirs, 1e-3 * theirs) << name;
      EXPECT_TRUE(options.shadowSamples > 0 || unlike <= cpu.pixelCount() / 1000)
          << name << ": " << unlike;
    }
  }
}

TEST(FieldScene, IsLitThroughMeshes) {
  // Light in its share through a sheet between it and the ball.
  for (const auto& draw : {renderCpu, renderEmbree}) {
    const auto brightness = [&](double opacity) {
      Scene scene = halfWayBall(65, {});
      if (opacity > 0) scene.meshes = {{sheet(40), {}, 3, "roof", opacity}};
      const Image image = draw(scene, {.samples = 1, .ambientSamples = 0, .shadowSamples = 4});
      double sum = 0;
      for (const float r : image.channels.at("R")) sum += static_cast<double>(r);
      return sum;
    };
    const double open = brightness(0), dark = brightness(1);
    EXPECT_LT(dark, 0.95 * open);
    EXPECT_NEAR(brightness(0.3), dark + (open - dark) * 0.7, 1e-4 * open);
  }
}

TEST(FieldScene, HasNoOpacity) {
  Scene scene = halfWayBall(0, {});
  scene.solids[1].opacity = 0.5;
  for (const auto& draw : {renderCpu, renderEmbree, renderGpu})
    EXPECT_THROW((void)draw(scene, kDataOnly), levelset::UsageError);
}

TEST(FieldScene, IsDrawnOfCoarseValuesByBothRenderers) {
  for (const int bits : {16, 8})
    for (const bool isMorph : {false, true}) {
      Scene scene = isMorph ? morphed(threeGrids()[0], threeGrids()[2], 0.4)
                            : blended(threeGrids(), "(a | b) - c", 2.5, 160, 120);
      const Image whole = renderCpu(scene, kDataOnly);
      double step = 0;
      for (Solid& solid : scene.solids) {
        CoarseBand coarse = coarsened(solid.band, bits);
        solid.band = std::move(coarse.band);
        solid.held = coarse.held;
        step = std::max(step, static_cast<double>(coarse.held.step));
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

TEST(FieldScene, HasTheNormalsOfTheFinerGridWhereItIs) {
  // A coarse ball and a fine bump on it: the bump's normals are as good as alone.
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

TEST(FieldScene, IsRefusedWhereItCannotBe) {
  const NarrowBand ball = levelset::makeSphere(8, V3d(0), 1),
                   fine = levelset::makeSphere(8, V3d(9, 0, 0), 0.5);
  EXPECT_NO_THROW((void)renderCpu(blended({ball, fine}, "a | b", 1.4, 8, 8), kDataOnly));
  // Five steps within each other may take up to 5/4 K off the narrower band's 1.5.
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
  EXPECT_THROW((void)renderGpu(morphed(ball, fine, 0.5, 8, 8), kDataOnly), levelset::UsageError);
}

TEST(KernelScene, TakesTheFinerGridFirst) {
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
