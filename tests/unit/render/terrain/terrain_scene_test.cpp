// Pictures of terrains: the judge, shadows, other parts in the scene, solids in place of a part of
// the ground, and scene files.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "levelset/terrain/ground_mesh.h"
#include "render/cpu/cpu_renderer.h"
#include "render/cpu/cpu_tracer.h"
#include "render/embree/embree_renderer.h"
#include "render/embree/terrain/terrain_judge.h"
#include "render/images/compare_images.h"
#include "render/kernel/kernel_scene.h"
#include "render/views/scene_file.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/picture_agreement.h"
#include "tests/support/terrain_rays.h"
#include "tests/support/threads.h"

namespace terrain_scene_test {

using Imath::V3d;
using levelset::HeightField;
using terrain_rays::cameraAt;
using terrain_rays::Numbers;
using terrain_rays::shared;
using namespace render;

const RenderOptions kPlain{.samples = 1, .ambientSamples = 0, .shadowSamples = 0};

Scene sceneOf(HeightField field, const TerrainOptions& options = {}) {
  Scene scene;
  scene.terrains.push_back(
      {.caster = TerrainCaster(shared(std::move(field)), options), .id = 5, .name = "land"});
  scene.camera = cameraAt(scene.bounds(), V3d(1, -1.5, 1), 2.5, 48);
  return scene;
}

/// Views from above, nearly level, from below, from between the hills, and along an axis without
/// perspective.
std::vector<Camera> viewsOf(const TerrainCaster& caster, int size) {
  const Imath::Box3d& box = caster.bounds();
  std::vector<Camera> views = {
      cameraAt(box, V3d(1, -1.5, 1), 2, size), cameraAt(box, V3d(-1, 0.3, 0.08), 1.5, size),
      cameraAt(box, V3d(0.4, 1, -0.7), 2, size), cameraAt(box, V3d(0.3, 0.2, 0.1), 0.2, size),
      cameraAt(box, V3d(1, 0, 0.4), 1.2, size)};
  views.push_back(cameraAt(box, V3d(0, 0, 1), 2, size));
  views.back().up = {0, 1, 0};
  views.back().orthoHeight = 0.7123 * box.size().y;
  // No ray lies in a plane of the grid, where two triangles have the same distance.
  for (Camera& view : views) view.to += box.size() * V3d(0.00123, 0.00211, 0);
  views.back().from += box.size() * V3d(0.00123, 0.00211, 0);
  return views;
}

TEST(TerrainScene, MeetsTheRaysOfTheJudge) {
  HeightField holes = support::randomTerrain(30, 41, 0.1, 3);
  holes.spacing = {0.7, 1.3};
  HeightField far = terrain_rays::hills(65, 65, 10);
  far.origin += Imath::V2d(1e6, -3e6);
  std::size_t hits = 0, oneOnly = 0;
  double distance = 0, normal = 0;
  for (const HeightField& field :
       {terrain_rays::hills(65, 65, 1), terrain_rays::roughGround(97, 97, 0.5), holes, far}) {
    const TerrainCaster caster(shared(field));
    const TerrainJudge judge(caster);
    const double diagonal = caster.bounds().size().length();
    for (const Camera& camera : viewsOf(caster, 64))
      for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x) {
          const Camera::Ray ray = camera.ray(x + 0.5, y + 0.5);
          const TerrainHit found = caster.firstHit(ray);
          const JudgedGround judged = judge.firstHit(ray);
          hits += judged.found;
          oneOnly += found.found != judged.found;
          if (!found.found || !judged.found) continue;
          // Rays nearly in the plane of a triangle have an error that grows with the inverse sine.
          const double steep = std::abs(judged.facetNormal.dot(ray.direction));
          distance =
              std::max(distance, std::abs(found.distance - judged.distance) * steep / diagonal);
          normal = std::max(normal, (found.normal - judged.normal).length() * steep);
        }
  }
  EXPECT_GT(hits, 30'000U);
  EXPECT_EQ(oneOnly, 0U);
  EXPECT_LT(distance, support::doubleRounding(4));  // 2.2 measured
  EXPECT_LT(normal, support::measured(3.1e-14));
}

TEST(TerrainScene, HasThePictureOfTheJudge) {
  for (const TerrainOptions& options : {TerrainOptions(), TerrainOptions{.isSmooth = false}}) {
    Scene scene = sceneOf(terrain_rays::hills(65, 49, 0.25), options);
    for (const Camera& camera : viewsOf(scene.terrains[0].caster, 40)) {
      scene.camera = camera;
      const Image image = renderCpu(scene, kPlain);
      const ImageComparison found = compareImages(image, renderEmbree(scene, kPlain));
      EXPECT_TRUE(found.agrees()) << found.reason();
      EXPECT_GT(found.bothHit, 300U);
      const std::vector<std::uint32_t>& ids = image.ids.at("id");
      EXPECT_TRUE(std::all_of(ids.begin(), ids.end(), [](auto id) { return id == 0 || id == 5; }));
      EXPECT_EQ(image.attributes.at("ls:terrain").substr(0, 13), "65x49 samples");
    }
  }
}

TEST(TerrainScene, StandsBesideSolidsAndMirrorsThem) {
  Scene scene = sceneOf(support::terrainOf(9, 9, {1, 1}, [](double x, double) { return 0.1 * x; }));
  scene.solids.push_back({.band = levelset::makeSphere(1.2, V3d(0, 0, 0.6), 0.1), .id = 8});
  Image image = renderCpu(scene, kPlain);
  const std::vector<std::uint32_t>& ids = image.ids.at("id");
  EXPECT_EQ((std::set<std::uint32_t>{ids.begin(), ids.end()}), (std::set<std::uint32_t>{0, 5, 8}));
  const ImageComparison found = compareImages(image, renderEmbree(scene, kPlain));
  EXPECT_TRUE(found.agrees()) << found.reason();
  // Mirrored rays meet the ground and the solid.
  RenderOptions mirror = kPlain;
  mirror.optics.reflect = 0.8;
  const Image mirrored = renderCpu(scene, mirror), judged = renderEmbree(scene, mirror);
  std::size_t unlike = 0;
  for (std::size_t n = 0; n < ids.size(); ++n)
    unlike += std::abs(mirrored.channels.at("R")[n] - judged.channels.at("R")[n]) > 0.01f;
  EXPECT_LE(unlike, ids.size() / 200);
}

TEST(TerrainScene, BlocksLightAsTheJudgeSays) {
  Scene scene = sceneOf(terrain_rays::hills(33, 33, 1));
  scene.solids.push_back({.band = levelset::makeSphere(3, V3d(4, 3, 2), 0.25), .id = 8});
  const KernelScene surfaces(scene, RenderOptions{});
  const Imath::Box3d box = scene.terrains[0].caster.bounds();
  Numbers numbers(4);
  std::vector<LightRay> rays;
  for (int n = 0; n < 2000; ++n) {
    const V3d origin = box.center() + box.size() * numbers.inBox(0.7);
    rays.push_back({origin, numbers.unit(), numbers.between(2, 20), 1});
  }
  const std::vector<double> light = surfaces.transmittances(CpuTracer(), rays);
  const EmbreeScene judge(scene);
  std::size_t blocked = 0, unlike = 0;
  for (std::size_t n = 0; n < rays.size(); ++n) {
    unlike += (light[n] == 0) !=
              judge.isOccluded(rays[n].origin, rays[n].direction, 0, rays[n].maxDistance);
    blocked += light[n] == 0;
  }
  EXPECT_EQ(unlike, 0U);
  EXPECT_GT(blocked, 500U);
  EXPECT_LT(blocked, 1900U);
}

TEST(TerrainScene, CastsAndReceivesShadows) {
  const RenderOptions lit{.samples = 4, .ambientSamples = 0, .shadowSamples = 4};
  const auto brightness = [&](const Scene& scene, std::uint32_t id) {
    const Image image = renderCpu(scene, lit);
    double sum = 0, count = 0;
    for (std::size_t n = 0; n < image.ids.at("id").size(); ++n)
      if (image.ids.at("id")[n] == id) {
        sum += static_cast<double>(image.channels.at("R")[n]);
        ++count;
      }
    return sum / count;
  };
  // A ball above a level ground, with light from above: the ground is darker below it.
  Scene scene = sceneOf(support::terrainOf(9, 9, {1, 1}, [](double, double) { return 0; }));
  scene.camera = {.from = {0, -0.1, 12}, .up = {0, 1, 0}, .width = 48, .height = 48};
  scene.key.direction = {0.3, 0.3, 1};
  const double open = brightness(scene, 5);
  scene.solids.push_back({.band = levelset::makeSphere(1.5, V3d(0, 0, 3), 0.1), .id = 8});
  EXPECT_LT(brightness(scene, 5), 0.97 * open);
  // A high wall of ground beside a ball hides the light from it.
  Scene beside = sceneOf(support::terrainOf(
      21, 5, {0.5, 4}, [](double x, double) { return x > 1.6 && x < 3 ? 9 : -4; }));
  beside.solids.push_back({.band = levelset::makeSphere(0.8, V3d(-1, 0, 0), 0.1), .id = 8});
  beside.camera = {.from = {0, -14, 0}, .up = {0, 0, 1}, .width = 48, .height = 48};
  beside.key.direction = {1, 0.1, 0.2};
  const double dark = brightness(beside, 8);
  beside.terrains.clear();
  EXPECT_LT(dark, 0.8 * brightness(beside, 8));
}

TEST(TerrainScene, HasTheColoursOfARamp) {
  Scene scene = sceneOf(support::terrainOf(17, 17, {1, 1}, [](double x, double) { return x; }));
  TerrainPart& part = scene.terrains[0];
  part.ramp = {{-4, {0.8f, 0, 0}}, {4, {0, 0.8f, 0}}};
  for (const auto& [height, red] : std::vector<std::pair<double, float>>{
           {-9.0, 0.8f}, {-4.0, 0.8f}, {0.0, 0.4f}, {4.0, 0.0f}, {7.0, 0.0f}}) {
    EXPECT_FLOAT_EQ(part.colourAt(height).x, red);
    EXPECT_FLOAT_EQ(part.colourAt(height).y, 0.8f - red);
  }
  scene.camera = {.from = {0, 0, 30}, .up = {0, 1, 0}, .width = 16, .height = 16};
  const Image image = renderCpu(scene, kPlain), judged = renderEmbree(scene, kPlain);
  for (const char* channel : {"R", "G"})
    for (std::size_t n = 0; n < 256; ++n)
      EXPECT_NEAR(image.channels.at(channel)[n], judged.channels.at(channel)[n], 1e-5);
  const std::size_t row = 8 * 16;
  EXPECT_GT(image.channels.at("R")[row + 4], image.channels.at("G")[row + 4]);
  EXPECT_LT(image.channels.at("R")[row + 11], image.channels.at("G")[row + 11]);
  part.ramp = {{1, {0, 0, 0}}, {1, {1, 1, 1}}};
  EXPECT_THROW(static_cast<void>(renderCpu(scene, kPlain)), levelset::InvalidInput);
}

TEST(TerrainScene, HasTheSameBitsForAnyNumberOfThreads) {
  const Scene scene = sceneOf(terrain_rays::roughGround(129, 129, 1));
  const RenderOptions options{.samples = 2, .ambientSamples = 2, .shadowSamples = 2};
  const auto onThreads = [&](std::size_t count) {
    return support::onThreads(count, [&] { return renderCpu(scene, options).channels; });
  };
  EXPECT_EQ(onThreads(1), onThreads(3));
}

/// Compares a picture of a terrain with one in which a solid replaces the ground in a box.
struct Seam {
  std::size_t ground = 0;      ///< pixels that show the terrain
  std::size_t background = 0;  ///< those among them that do not show a surface with the solid
  std::size_t ofSolid = 0;     ///< pixels that show the solid
  double distance = 0;         ///< largest distance of the solid from the ground, world units
  support::DepthAgreement depths = {};
};

Seam seamOf(const HeightField& field, const Imath::Box3d& box, double voxel, const Camera& camera) {
  Scene alone = sceneOf(field);
  Scene both = sceneOf(field, {.outside = box});
  both.solids.push_back(
      {.band = levelset::solidify(levelset::croppedHeights(field, box), box.min.z, voxel).band,
       .id = 8});
  alone.camera = both.camera = camera;
  const TerrainCaster& ground = alone.terrains[0].caster;
  const Image expected = renderCpu(alone, kPlain), found = renderCpu(both, kPlain);
  Seam seam;
  for (std::size_t n = 0; n < expected.ids.at("id").size(); ++n) {
    if (expected.ids.at("id")[n] == 0) continue;
    ++seam.ground;
    if (found.ids.at("id")[n] == 0) {
      ++seam.background;
      continue;
    }
    if (found.ids.at("id")[n] != 8) continue;
    ++seam.ofSolid;
    const auto at = [&](const char* name) {
      return static_cast<double>(found.channels.at(name)[n]);
    };
    const V3d hit(at("P.X"), at("P.Y"), at("P.Z"));
    const TerrainHit below = ground.firstHit({V3d(hit.x, hit.y, box.max.z + 1), V3d(0, 0, -1)});
    seam.distance =
        std::max(seam.distance, std::abs(below.height - hit.z) * std::abs(below.facetNormal.z));
  }
  seam.depths = support::compareDepths(expected, found, 2 * voxel);
  return seam;
}

TEST(TerrainScene, HasNoSeamAroundASolid) {
  const HeightField field = terrain_rays::hills(65, 65, 1);
  const Imath::Box3d box(V3d(-10, -8, -12), V3d(9, 11, 12));
  const double voxel = 0.25;
  // Views across all four walls, from high and nearly level eyes.
  for (const V3d& away : {V3d(1, 0.2, 0.9), V3d(-1, 0.3, 0.5), V3d(0.2, 1, 0.35),
                          V3d(-0.3, -1, 0.35), V3d(0.7, -0.7, 0.5), V3d(0.01, 0, 1)}) {
    Camera camera = cameraAt(field.bounds(), away, 0.9, 96);
    camera.to = box.center();
    const Seam seam = seamOf(field, box, voxel, camera);
    EXPECT_GT(seam.ground, 2000U);
    EXPECT_GT(seam.ofSolid, 500U);
    EXPECT_EQ(seam.background, 0U);
    EXPECT_LT(seam.distance, support::measured(0.0581, voxel));
    EXPECT_EQ(seam.depths.unlike, 0U);
    EXPECT_GT(seam.depths.compared, 700U);
    EXPECT_LT(seam.depths.largest, support::measured(0.0867, voxel));
  }
}

/// Pixels of a lit picture whose colours differ from those of the ground alone by more than a
/// tenth, beside the walls of a solid that replaces the ground in a box.
std::size_t rimOf(const HeightField& field, const Imath::Box3d& box, double lowered,
                  const V3d& away) {
  constexpr double kVoxel = 0.25;
  Scene alone = sceneOf(field, {.isSmooth = false});
  Scene both = sceneOf(field, {.isSmooth = false, .outside = box});
  const HeightField part = levelset::loweredEdges(levelset::croppedHeights(field, box), lowered);
  both.solids.push_back({.band = levelset::solidify(part, box.min.z, kVoxel).band, .id = 8});
  alone.terrains[0].colour = both.terrains[0].colour = both.solids[0].colour = {0.8f, 0.8f, 0.8f};
  alone.camera = cameraAt(field.bounds(), away, 0.9, 128);
  alone.camera.to = box.center();
  both.camera = alone.camera;
  const RenderOptions options{.samples = 1, .ambientSamples = 0, .shadowSamples = 4};
  const Image expected = renderCpu(alone, options), found = renderCpu(both, options);
  std::size_t rim = 0;
  for (std::size_t n = 0; n < expected.ids.at("id").size(); ++n) {
    const double x = static_cast<double>(expected.channels.at("P.X")[n]),
                 y = static_cast<double>(expected.channels.at("P.Y")[n]);
    const double inside =
        std::min(std::min(x - box.min.x, box.max.x - x), std::min(y - box.min.y, box.max.y - y));
    if (expected.ids.at("id")[n] == 0 || std::abs(inside) > 0.5) continue;
    if (std::abs(found.channels.at("G")[n] - expected.channels.at("G")[n]) > 0.08f) ++rim;
  }
  return rim;
}

/// The edges of a solid show through the ground at the walls of its box, unless they are lowered.
TEST(TerrainScene, HasNoRimAroundASolidWithLoweredEdges) {
  const HeightField field = terrain_rays::hills(65, 65, 1);
  const Imath::Box3d box(V3d(-10, -8, -12), V3d(9, 11, 12));
  std::size_t level = 0, lowered = 0;
  for (const V3d& away : {V3d(1, 0.2, 0.9), V3d(-0.3, -1, 0.6), V3d(-1, 0.3, 0.7)}) {
    level += rimOf(field, box, 0, away);
    lowered += rimOf(field, box, 0.125, away);
  }
  EXPECT_GT(level, 30U);
  EXPECT_LE(lowered, 6U);
}

TEST(TerrainScene, ShowsACaveInTheGround) {
  const HeightField field =
      support::terrainOf(41, 41, {0.5, 0.5}, [](double, double) { return 0; });
  const Imath::Box3d box(V3d(-5, -5, -4), V3d(5, 5, 1));
  Scene scene = sceneOf(field, {.outside = box});
  const levelset::NarrowBand earth =
      levelset::solidify(levelset::croppedHeights(field, box), box.min.z, 0.2).band;
  scene.solids.push_back(
      {.band = levelset::subtract(earth, levelset::makeSphere(2, V3d(0, 0, -0.5), 0.2)), .id = 8});
  scene.camera = {.from = {0, 0, 20}, .up = {0, 1, 0}, .width = 41, .height = 41};
  const Image image = renderCpu(scene, kPlain);
  // The floor of the cave, and the ground beside the box.
  EXPECT_NEAR(image.channels.at("Z")[20 * 41 + 20], 22.5, 0.05);
  EXPECT_EQ(image.ids.at("id")[20 * 41 + 20], 8U);
  EXPECT_NEAR(image.channels.at("Z")[20 * 41 + 2], 20, 0.01);
  EXPECT_EQ(image.ids.at("id")[20 * 41 + 2], 5U);
}

TEST(TerrainScene, IsReadAndWritten) {
  const support::TemporaryFolder folder;
  Imath::M44d transform;
  transform.rotate(V3d(0.1, 0.2, 0.3));
  Scene scene = sceneOf(terrain_rays::hills(33, 33, 1),
                        {.transform = transform,
                         .isSmooth = false,
                         .outside = Imath::Box3d(V3d(-4, -4, -9), V3d(4, 4, 9))});
  scene.terrains[0].ramp = {{-1, {0.5f, 0.25f, 0}}, {1, {1, 1, 0.125f}}};
  scene.solids.push_back(
      {.band = levelset::makeSphere(0.6, V3d(2, 0, 0), 0.1), .id = 8, .name = "ball"});
  const std::filesystem::path file = folder.path() / "scene.json";
  writeScene(file, {scene, true});
  const ViewedScene again = readScene(file);
  ASSERT_EQ(again.scene.terrains.size(), 1U);
  const TerrainPart& part = again.scene.terrains[0];
  EXPECT_EQ(part.name, "land");
  EXPECT_EQ(part.id, 5U);
  EXPECT_EQ(part.ramp.size(), 2U);
  EXPECT_FALSE(part.caster.options().isSmooth);
  EXPECT_EQ(part.caster.field().heights, scene.terrains[0].caster.field().heights);
  EXPECT_EQ(renderCpu(scene, kPlain).channels, renderCpu(again.scene, kPlain).channels);
  EXPECT_THROW(static_cast<void>(readScene(file, {.maxMemory = 3000})), levelset::ResourceLimit);
}

TEST(TerrainScene, RefusesFilesThatAreNotValid) {
  const support::TemporaryFolder folder;
  std::ofstream(folder.path() / "a.asc") << "ncols 2\nnrows 2\nxllcenter 0\nyllcenter 0\n"
                                            "cellsize 1\n0 1\n2 3\n";
  std::ofstream(folder.path() / "row.asc")
      << "ncols 2\nnrows 1\nxllcenter 0\nyllcenter 0\ncellsize 1\n0 1\n";
  const auto reading = [&](const std::string& members) {
    const std::filesystem::path file = folder.path() / "scene.json";
    std::ofstream(file)
        << R"({"format": "levelsmith scene", "version": 1, "terrains": [{"name": "a")" << members
        << "}]}";
    return readScene(file);
  };
  EXPECT_EQ(reading(R"(, "file": "a.asc")").scene.terrains.size(), 1U);
  EXPECT_THROW(reading(""), levelset::InvalidInput);
  EXPECT_THROW(reading(R"(, "file": "row.asc")"), levelset::InvalidInput);
  EXPECT_THROW(reading(R"(, "file": "none.asc")"), levelset::IoError);
  for (const char* member :
       {R"("opacity": 0.5)", R"("smooth": 1)", R"("outside": [0, 0, 0])",
        R"("outside": [[0, 0, 0], [1, 1]])", R"("outside": [[-9, -9, 1], [9, 9, 2]])",
        R"("outside": [[900, 900, -9], [990, 990, 9]])", R"("ramp": 1)",
        R"("ramp": [{"height": 1}])", R"("ramp": [{"height": 1, "colour": [2, 0, 0]}])",
        R"("transform": [1, 0])", R"("transform": [1,0,0,0, 0,1,0,0, 0,0,0,0, 0,0,0,1])"})
    EXPECT_THROW(reading(std::string(R"(, "file": "a.asc", )") + member), levelset::InvalidInput)
        << member;
}

TEST(TerrainScene, RefusesBlendsAndThickness) {
  Scene scene = sceneOf(terrain_rays::hills(9, 9, 1));
  RenderOptions options = kPlain;
  options.thickness = true;
  EXPECT_THROW(static_cast<void>(renderCpu(scene, options)), levelset::UsageError);
  scene.solids.push_back({.band = levelset::makeSphere(0.6, V3d(0), 0.1), .id = 8});
  scene.solids.push_back({.band = levelset::makeSphere(0.6, V3d(1, 0, 0), 0.1), .id = 9});
  scene.morph = 0.5;
  EXPECT_THROW(static_cast<void>(renderCpu(scene, kPlain)), levelset::UsageError);
}

}  // namespace terrain_scene_test
