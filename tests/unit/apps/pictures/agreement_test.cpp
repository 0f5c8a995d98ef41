// Compares the renderers on models without formulas. The kernel on the processor and as a shader
// must agree to the bit. Both must agree with the judge within the tolerances of pictures.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/csg/csg.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/transform.h"
#include "mapping/generators/knurl.h"
#include "mapping/placement/patch_grid.h"
#include "mapping/textures/geometric_texture.h"
#include "render/cpu/cpu_renderer.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/images/compare_images.h"
#include "tests/support/measured.h"
#include "tests/support/render_scenes.h"

namespace agreement_test {

using Imath::V3d;
using levelset::NarrowBand;
using namespace render;

std::filesystem::path modelPath(const char* name) {
  return std::filesystem::path(LEVELSMITH_DATA_DIR) / "models" / name;
}

/// @param resolution  voxels along the longest side
NarrowBand model(const char* name, double resolution) {
  const levelset::TriMesh mesh = levelset::readMesh(modelPath(name));
  const V3d size = levelset::bounds(mesh).size();
  return levelset::meshToBand(mesh, std::max({size.x, size.y, size.z}) / resolution).band;
}

/// A cylinder with a knurl around it.
NarrowBand knurledCylinder(double voxelSize) {
  const NarrowBand base = levelset::makeCylinder(1, 3.05, V3d(0), V3d(0, 0, 1), 0.05);
  const mapping::Knurl knurl{.depth = 0.2, .flankAngle = 2, .base = 0.3, .tiling = {2, 1, 0.15}};
  const mapping::PatchGridResult grid = mapping::makePatchGridAround(
      base, V3d(0, 0, -0.6), V3d(0, 0, 0.6), 0, 0.2, {.columns = 4, .rows = 2},
      {.layers = 3, .scheme = mapping::LayerScheme::Conforming, .spacing = 0.15});
  return mapping::mapTexture(base, mapping::makeKnurl(knurl, V3d(0), 0.04), grid.patches,
                             {.embedDepth = 0.05,
                              .textureBox = mapping::knurlBox(knurl, V3d(0)).tile,
                              .voxelSize = voxelSize})
      .band;
}

/// Three bands of different voxel sizes in one picture, and a box from which a part is subtracted.
Scene csgScene(int width, int height) {
  const NarrowBand cut =
      levelset::subtract(levelset::makeBox(V3d(60, 40, 30), V3d(0), 1),
                         levelset::makeTorus(20, 9, V3d(5, 3, 14), V3d(0, 0, 1), 1));
  Scene scene = support::sceneOf(cut, width, height);
  scene.solids.push_back({.band = levelset::makeSphere(12, V3d(5, 3, 12), 0.37), .id = 2});
  scene.solids.push_back({.band = support::rings(), .id = 3});
  return scene;
}

/// A ball, a ring and a box of three voxel sizes, rotated against each other, for an expression.
Scene sceneAlongRays(const std::string& csg) {
  const auto turned = [](const NarrowBand& band, const V3d& axis, double angle, double scale) {
    return levelset::transform(
        band, Imath::M44d().setScale(scale) * Imath::M44d().setAxisAngle(axis.normalized(), angle));
  };
  Scene scene = support::sceneOf(levelset::makeSphere(20, V3d(3, 1, 4), 0.55));
  scene.solids.push_back({.band = turned(levelset::makeTorus(30, 11, V3d(0), V3d(0, 0, 1), 1),
                                         V3d(1, 2, 0), 0.7, 0.83),
                          .colour = Imath::C3f(0.35f, 0.5f, 0.66f),
                          .id = 2});
  scene.solids.push_back({.band = turned(levelset::makeBox(V3d(18, 44, 20), V3d(9, 2, 7), 0.37),
                                         V3d(-1, 1, 3), -0.4, 1.1),
                          .colour = Imath::C3f(0.7f, 0.42f, 0.32f),
                          .id = 3});
  scene.csg = CsgExpression(csg, {"a", "b", "c"});
  scene.camera = framingCamera(scene.bounds(), 1024, 768);
  return scene;
}

const RenderOptions kData = {.samples = 1, .ambientSamples = 0, .shadowSamples = 0};

/// True for pixels on no outline and on no surface so steep that a pixel spans voxels.
bool isOffOutlines(const Image& image, const Scene& scene, int x, int y) {
  constexpr double kSteep = 0.1;
  const auto index = [&](int u, int v) {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width) +
           static_cast<std::size_t>(u);
  };
  for (int v = std::max(0, y - 1); v <= std::min(image.height - 1, y + 1); ++v)
    for (int u = std::max(0, x - 1); u <= std::min(image.width - 1, x + 1); ++u)
      if (!std::isfinite(image.channels.at("Z")[index(u, v)])) return false;
  const std::size_t i = index(x, y);
  const V3d normal(image.channels.at("N.X")[i], image.channels.at("N.Y")[i],
                   image.channels.at("N.Z")[i]);
  return -normal.dot(scene.camera.ray(x + 0.5, y + 0.5).direction) > kSteep;
}

/// Tests the required agreement of a picture.
void expectAgreement(const Scene& scene, const std::string& what) {
  const Image ours = renderCpu(scene, kData), judge = renderEmbree(scene, kData);
  const ImageComparison found = compareImages(ours, judge);
  EXPECT_TRUE(found.agrees()) << what << ": " << found.reason();
  EXPECT_GT(found.bothHit, found.pixels / 10) << what;
  EXPECT_EQ(found.unlikeElsewhere, 0u) << what;
  EXPECT_LE(static_cast<double>(found.unlikeAtOutline), 1e-5 * static_cast<double>(found.pixels))
      << what;
  double voxel = HUGE_VAL;
  for (const Solid& solid : scene.solids) voxel = std::min(voxel, solid.band.voxelSize());
  std::size_t compared = 0, beyond = 0;
  double deepest = 0, turned = 0;
  for (int y = 0; y < ours.height; ++y)
    for (int x = 0; x < ours.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(ours.width) +
                            static_cast<std::size_t>(x);
      const double a = ours.channels.at("Z")[i], b = judge.channels.at("Z")[i];
      if (!std::isfinite(a) || !std::isfinite(b)) continue;
      ++compared;
      beyond += std::abs(a - b) > 1e-3 * voxel;
      if (!isOffOutlines(judge, scene, x, y)) continue;
      deepest = std::max(deepest, std::abs(a - b) / voxel);
      const auto normal = [&](const Image& image) {
        return V3d(image.channels.at("N.X")[i], image.channels.at("N.Y")[i],
                   image.channels.at("N.Z")[i]);
      };
      turned = std::max(turned, 2 * std::asin((normal(ours) - normal(judge)).length() / 2));
    }
  EXPECT_LE(static_cast<double>(beyond), 1e-4 * static_cast<double>(compared)) << what;
  EXPECT_LE(deepest, support::measured(5.22e-4, 2e-3)) << what;
  EXPECT_LE(turned, support::measured(2.56e-4, 0.1 * std::numbers::pi / 180)) << what;
}

void expectSameBits(const Scene& scene, const std::string& what) {
  const RenderOptions options = {.samples = 2, .ambientSamples = 2, .shadowSamples = 1};
  const ImageComparison found =
      compareImages(renderGpu(scene, options), renderCpu(scene, options), {.exact = true});
  EXPECT_GT(found.bothHit, 500u) << what;
  EXPECT_EQ(found.differentBits, 0u) << what << ": " << found.reason();
}

Scene resized(Scene scene, int width, int height) {
  scene.camera.width = width;
  scene.camera.height = height;
  return scene;
}

/// Tests a scene.
/// @param size  1: agreement at 1024x768 pixels, equal bits at 320x240
void expectProven(const Scene& scene, const std::string& what, double size) {
  const auto pixels = [&](int most) { return static_cast<int>(most * size); };
  expectAgreement(resized(scene, pixels(1024), pixels(768)), what);
  expectSameBits(resized(scene, pixels(320), pixels(240)), what);
}

constexpr double kQuickSize = 0.5;

void expectBallsAndCsgProven(double size) {
  expectProven(support::sceneOf(levelset::makeSphere(100, V3d(0.3, 0.2, 0.1), 1)), "ball", size);
  expectProven(csgScene(1024, 768), "csg", size);
}

TEST(Agreement, OfBallsAndTheSolidsOfCsg) {
  expectBallsAndCsgProven(kQuickSize);
}

TEST(SlowAgreement, OfBallsAndTheSolidsOfCsg) {
  expectBallsAndCsgProven(1);
}

void expectExpressionsProven(double size) {
  for (const char* csg : {"(a | b) - c", "a & b | c - a"})
    expectProven(sceneAlongRays(csg), csg, size);
}

TEST(Agreement, OfAnExpressionAlongTheRays) {
  expectExpressionsProven(kQuickSize);
}

TEST(SlowAgreement, OfAnExpressionAlongTheRays) {
  expectExpressionsProven(1);
}

TEST(Agreement, OfATexturedSolid) {
  expectProven(support::sceneOf(knurledCylinder(0.03)), "knurled cylinder", kQuickSize);
}

TEST(SlowAgreement, OfATexturedSolid) {
  expectProven(support::sceneOf(knurledCylinder(0.02)), "knurled cylinder", 1);
}

/// @param resolution  voxels along the longest side
void expectBunnyProven(double resolution, double size) {
  if (!std::filesystem::exists(modelPath("bunny.obj"))) GTEST_SKIP() << "no models";
  const NarrowBand bunny = model("bunny.obj", resolution);
  expectProven(support::sceneOf(bunny), "bunny", size);
  // From inside, with an ear in front of the eye.
  Scene scene = support::sceneOf(bunny, 320, 240);
  const Imath::Box3d box = bunny.zeroSetBounds();
  scene.camera.from = box.center();
  scene.camera.to = V3d(box.min.x, box.max.y, box.center().z);
  expectSameBits(scene, "from within the bunny");
}

TEST(Agreement, OfTheBunny) {
  expectBunnyProven(128, kQuickSize);
}

TEST(SlowAgreement, OfTheBunny) {
  expectBunnyProven(256, 1);
}

/// @param resolution  voxels along the longest side
void expectDragonProven(const char* file, double resolution, double size) {
  if (!std::filesystem::exists(modelPath(file))) GTEST_SKIP() << "no models";
  const NarrowBand dragon = model(file, resolution);
  expectProven(support::sceneOf(dragon), "dragon", size);
  expectSameBits(support::seenFromFar(dragon), "dragon from 1e5 away");
}

TEST(Agreement, OfTheDragon) {
  expectDragonProven("dragon_vrip_res3.ply.gz", 160, kQuickSize);
}

TEST(SlowAgreement, OfTheDragon) {
  expectDragonProven("dragon_vrip_res2.ply.gz", 512, 1);
}

/// Pictures of a scene from positions all around it, some of them inside.
class ManyPlaces {
 public:
  /// @param change  changes the view by a random number in [0, 1)
  template <typename Change>
  void look(Scene& scene, const Change& change) {
    const V3d way = V3d(normal_(random_), normal_(random_), normal_(random_)).normalized();
    scene.camera.from = way * (20 + 100 * even_(random_));
    scene.camera.to = V3d(even_(random_), even_(random_), even_(random_)) * 8;
    scene.camera.verticalFov = 0.2 + 1.5 * even_(random_);
    change(scene.camera, even_(random_));
    const ImageComparison found =
        compareImages(renderCpu(scene, kData), renderEmbree(scene, kData));
    EXPECT_EQ(found.unlikeElsewhere, 0u)
        << "position " << positions_ << ", pixel " << (found.unlike.empty() ? 0 : found.unlike[0].x)
        << "," << (found.unlike.empty() ? 0 : found.unlike[0].y);
    ++positions_;
    pixels_ += found.pixels;
    hit_ += found.bothHit;
    atOutline_ += found.unlikeAtOutline;
  }
  /// Fails if one renderer hits and the other misses at a pixel, which is a hole or a false hit.
  /// Along outlines rounding decides.
  void expectNoLeak() const {
    EXPECT_GT(hit_, pixels_ / 10);
    EXPECT_LE(static_cast<double>(atOutline_), 1e-5 * static_cast<double>(pixels_));
  }

 private:
  std::mt19937 random_{5};
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> even_{0, 1};
  std::size_t positions_ = 0, pixels_ = 0, hit_ = 0, atOutline_ = 0;
};

void expectNoLeakFromPositions(int count) {
  Scene scene = support::sceneOf(support::rings(), 96, 72);
  scene.solids.push_back(
      {.band = levelset::makeBox(V3d(70, 40, 0.7), V3d(0.1, 0.2, -13), 1), .id = 2});
  ManyPlaces places;
  for (int n = 0; n < count; ++n) places.look(scene, [](Camera&, double) {});
  places.expectNoLeak();
}

TEST(Agreement, From80PositionsNothingLeaks) {
  expectNoLeakFromPositions(80);
}

TEST(SlowAgreement, From200PositionsNothingLeaks) {
  expectNoLeakFromPositions(200);
}

TEST(Agreement, OfAnExpressionBetweenTwoPlanesNothingLeaks) {
  Scene scene = resized(sceneAlongRays("(a - b) & c | b - a"), 96, 72);
  ManyPlaces places;
  for (int n = 0; n < 40; ++n)
    places.look(scene, [](Camera& camera, double share) {
      const double away = (camera.to - camera.from).length();
      camera.near = std::max(0.0, away + 30 * (share - 0.7));
      camera.far = camera.near + 15 + 30 * share;
    });
  places.expectNoLeak();
}

}  // namespace agreement_test
