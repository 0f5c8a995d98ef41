// Volumes with a transfer function among surfaces: closed forms, and the same picture by all
// renderers.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/shapes/shapes.h"
#include "levelset/volumes/synthetic.h"
#include "render/cpu/cpu_renderer.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/images/compare_images.h"
#include "render/views/scene_file.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/volume_scenes.h"

namespace volume_scene_test {

using Imath::C3f;
using Imath::M44d;
using Imath::V3d;
using Imath::V3i;
using levelset::Volume;
using support::measured;
using support::sampled;
using namespace render;

/// Without rays to lights, a colour depends on the normal alone.
const RenderOptions kNoRays = {.samples = 1, .ambientSamples = 0, .shadowSamples = 0};

VolumePart partOf(const Volume& volume, const std::vector<TransferPoint>& points,
                  bool isShaded = true) {
  return {DirectVolume(VolumeSurface(volume, volume.highest()), points), isShaded, "volume"};
}

/// Square across the view along −z.
std::shared_ptr<const levelset::TriMesh> sheet(double z) {
  levelset::TriMesh mesh;
  mesh.positions = {{-30, -30, z}, {30, -30, z}, {30, 30, z}, {-30, 30, z}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return std::make_shared<const levelset::TriMesh>(mesh);
}

constexpr double kExtinction = 0.17;
const V3d kGlow(0.9, 0.5, 0.2);

/// View along −z, from z = 20, at a slab of constant density from z = 0 to z = 10.
Scene slab(double extinction = kExtinction) {
  const M44d place = M44d().setTranslation(V3d(-10, -10, 0));
  const Volume volume = sampled({V3i(21, 21, 11), place}, [](const V3d&) { return 5; });
  Scene scene;
  scene.volumePart = partOf(volume, {{5, -std::expm1(-extinction), C3f(kGlow)}}, false);
  scene.camera.from = V3d(0, 0, 20);
  scene.camera.to = V3d(0);
  scene.camera.orthoHeight = 6;
  scene.camera.width = scene.camera.height = 8;
  return scene;
}

struct Seen {
  V3d colour{0};
  double alpha = 0;
};

Seen middleOf(const Image& image) {
  const std::size_t i = image.pixelCount() / 2 + static_cast<std::size_t>(image.width / 2);
  const auto at = [&](const char* name) { return static_cast<double>(image.channels.at(name)[i]); };
  return {V3d(at("R"), at("G"), at("B")), at("A")};
}

/// Puts a layer of the slab in front of what is seen.
Seen behind(double length, const Seen& back) {
  const double passed = std::exp(-kExtinction * length);
  return {V3d(C3f(kGlow)) * (1 - passed) + back.colour * passed, 1 - passed * (1 - back.alpha)};
}

Seen over(const Seen& front, double opacity, const Seen& back) {
  return {front.colour * opacity + back.colour * (1 - opacity),
          opacity + (1 - opacity) * back.alpha};
}

/// Renders by all renderers. The judge takes steps, but a constant density has no error.
void expectSeen(const Scene& scene, const Seen& wanted, const std::string& what) {
  const Image cpu = renderCpu(scene, kNoRays);
  for (const Image& image : {cpu, renderEmbree(scene, kNoRays)}) {
    const Seen seen = middleOf(image);
    EXPECT_LT((seen.colour - wanted.colour).length(), support::rounding(1)) << what;
    EXPECT_NEAR(seen.alpha, wanted.alpha, support::rounding(0.5)) << what;
  }
  EXPECT_EQ(compareImages(cpu, renderGpu(scene, kNoRays), {.exact = true}).reason(), "") << what;
}

TEST(VolumeScene, EndsAtOpaqueSurfacesInFrontInsideAndBehind) {
  expectSeen(slab(), behind(10, {}), "no surface");
  for (const auto& [z, length] : {std::pair(13.0, 0.0), {10, 0}, {7.25, 2.75}, {4, 6}, {-3, 10}}) {
    Scene scene = slab();
    scene.meshes.push_back({sheet(z)});
    Scene alone = scene;
    alone.volumePart.reset();
    expectSeen(scene, behind(length, middleOf(renderCpu(alone, kNoRays))),
               "mesh at " + std::to_string(z));
  }
  for (const double top : {12.5, 6.5, -2.0}) {
    Scene scene = slab();
    scene.solids.push_back({.band = levelset::makeBox(V3d(40, 40, 4), V3d(0, 0, top - 2), 1)});
    Scene alone = scene;
    alone.volumePart.reset();
    expectSeen(scene, behind(std::clamp(10 - top, 0.0, 10.0), middleOf(renderCpu(alone, kNoRays))),
               "solid below " + std::to_string(top));
  }
}

TEST(VolumeScene, IsBlendedBetweenTransparentSurfaces) {
  // In front, inside, inside, and behind, where an opaque sheet ends the ray.
  Scene scene = slab();
  const std::vector<std::pair<double, double>> sheets = {{12, 0.2}, {8.5, 0.35}, {3, 0.6}, {-1, 1}};
  std::vector<Seen> alone;
  for (const auto& [z, opacity] : sheets) {
    Scene one = slab();
    one.volumePart.reset();
    one.meshes.push_back({.mesh = sheet(z), .colour = C3f(0.2f, 0.4f, 0.8f)});
    alone.push_back(middleOf(renderCpu(one, kNoRays)));
    scene.meshes.push_back({.mesh = sheet(z),
                            .colour = C3f(0.2f, 0.4f, 0.8f),
                            .id = static_cast<std::uint32_t>(scene.meshes.size() + 1),
                            .opacity = opacity});
  }
  Seen wanted = behind(3, alone[3]);
  wanted = behind(5.5, over(alone[2], 0.6, wanted));
  wanted = behind(1.5, over(alone[1], 0.35, wanted));
  expectSeen(scene, over(alone[0], 0.2, wanted), "sheets");
  // Without the opaque sheet the light leaves the volume, and the rest is transparent.
  scene.meshes.pop_back();
  wanted = behind(3, {});
  wanted = behind(5.5, over(alone[2], 0.6, wanted));
  wanted = behind(1.5, over(alone[1], 0.35, wanted));
  expectSeen(scene, over(alone[0], 0.2, wanted), "open");
  // Transparent solids: each has two surfaces.
  Scene solids = slab();
  solids.solids.push_back({.band = levelset::makeBox(V3d(40, 40, 4), V3d(0, 0, 5), 1)});
  Scene one = solids;
  one.volumePart.reset();
  const Seen face = middleOf(renderCpu(one, kNoRays));
  solids.solids[0].opacity = 0.4;
  expectSeen(solids, behind(3, over(face, 0.4, behind(4, over(face, 0.4, behind(3, {}))))),
             "solid");
}

TEST(VolumeScene, IsCutByTheDepthsOfTheCamera) {
  Scene scene = slab();
  scene.camera.near = 12.5;  // z = 7.5
  expectSeen(scene, behind(7.5, {}), "near");
  scene.camera.far = 14;
  expectSeen(scene, behind(1.5, {}), "near and far");
}

TEST(VolumeScene, HidesSurfacesBehindDenseParts) {
  // Less than 1/512 of the light passes, so the ray ends in the volume.
  Scene scene = slab(0.7);
  scene.meshes.push_back({.mesh = sheet(-1), .colour = C3f(0, 0, 1)});
  const double passed = std::exp(-7.0);
  Scene alone = scene;
  alone.volumePart.reset();
  const Seen back = middleOf(renderCpu(alone, kNoRays));
  const V3d truth = V3d(C3f(kGlow)) * (1 - passed) + back.colour * passed;
  const Seen seen = middleOf(renderCpu(scene, kNoRays));
  EXPECT_EQ(seen.alpha, 1);
  EXPECT_LT((seen.colour - truth).length(), kLeastTransmittance);
  EXPECT_LT((seen.colour - V3d(C3f(kGlow))).length(), support::rounding(1));
  EXPECT_LT((middleOf(renderEmbree(scene, kNoRays)).colour - truth).length(), support::rounding(1));
  EXPECT_EQ(compareImages(renderCpu(scene), renderGpu(scene), {.exact = true}).reason(), "");
}

double wave(const V3d& p) {
  return 0.8 * std::sin(2.3 * p.x + 0.4) * std::cos(1.7 * p.y) + 0.3 * std::sin(3 * p.z);
}

/// Transfer functions for values from −1.1 to 1.1: peaks, a haze, and an almost opaque part.
std::vector<std::vector<TransferPoint>> functions() {
  return {{{-0.6, 0, C3f(1, 0.2f, 0.1f)},
           {-0.3, 0.2, C3f(0.9f, 0.4f, 0.1f)},
           {-0.1, 0, C3f(0.2f, 0.5f, 0.9f)},
           {0.1, 0, C3f(0.2f, 0.5f, 0.9f)},
           {0.3, 0.1, C3f(0.3f, 0.9f, 0.4f)},
           {0.5, 0.02, C3f(1)}},
          {{0, 0.03}},
          {{0.3, 0}, {0.31, 0.9, C3f(1, 0.5f, 0)}, {0.6, 0.3, C3f(0, 1, 0)}, {0.61, 0}}};
}

/// A sheared volume around a ball and a mesh, in perspective.
Scene mixed(const std::vector<TransferPoint>& points) {
  Scene scene;
  scene.volumePart = partOf(sampled({V3i(30), support::obliqueMap()}, wave), points);
  scene.solids.push_back({.band = levelset::makeSphere(0.35, V3d(0.2, 0.1, 0.1), 0.03)});
  levelset::TriMesh mesh;  // tilted, partly in front of the volume and partly behind it
  mesh.positions = {{-1.2, -1.5, -1}, {1.2, -1.4, 1}, {1.1, 0.4, 1.2}, {-1.3, 0.3, -0.9}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.meshes.push_back({.mesh = std::make_shared<const levelset::TriMesh>(mesh), .id = 2});
  scene.camera = framingCamera(scene, 60, 44, 0.6, V3d(0, 1, 0));
  return scene;
}

TEST(VolumeScene, HasTheSameBitsOnBothProcessors) {
  const RenderOptions lit = {.samples = 2, .ambientSamples = 3, .shadowSamples = 2};
  const auto expectEqual = [](const Scene& scene, const RenderOptions& options,
                              const std::string& what) {
    const Image cpu = renderCpu(scene, options);
    EXPECT_EQ(compareImages(cpu, renderGpu(scene, options), {.exact = true}).reason(), "") << what;
    std::size_t lights = 0;
    for (const float alpha : cpu.channels.at("volume.A")) lights += alpha > 0.01f;
    EXPECT_GT(lights, cpu.pixelCount() / 20) << what;
  };
  for (const std::vector<TransferPoint>& points : functions()) {
    Scene scene = mixed(points);
    expectEqual(scene, lit, "opaque");
    scene.volumePart->isShaded = false;
    scene.solids[0].opacity = 0.5;
    scene.meshes[0].opacity = 0.3;
    expectEqual(scene, lit, "transparent");
  }
  // An isosurface of the volume inside its light, by all filters.
  const Volume volume = sampled({V3i(30), support::obliqueMap()}, wave);
  const VolumeSurface surface(volume, 0.4);
  Scene iso;
  iso.volumePart = partOf(volume, functions()[0]);
  iso.solids.push_back({.band = {}, .volume = std::make_shared<const VolumeSurface>(surface)});
  iso.camera = framingCamera(iso, 48, 36, 0.6, V3d(0, 0, 1));
  for (const Filter filter : kFilters) {
    RenderOptions options = lit;
    options.filter = filter;
    expectEqual(iso, options, filterName(filter));
  }
  // A blended scene.
  Scene soft = mixed(functions()[0]);
  soft.solids[0].name = "a";
  soft.solids.push_back(
      {.band = levelset::makeSphere(0.3, V3d(-0.3, 0.1, 0.1), 0.03), .id = 3, .name = "b"});
  soft.csg = CsgExpression("a | b", {"a", "b"});
  soft.softness = 0.05;
  expectEqual(soft, lit, "soft");
}

TEST(VolumeScene, AgreesWithTheJudge) {
  for (const std::vector<TransferPoint>& points : functions()) {
    Scene scene = mixed(points);
    const Image cpu = renderCpu(scene, kNoRays), judged = renderEmbree(scene, kNoRays);
    const ImageComparison found = compareImages(cpu, judged);
    EXPECT_EQ(found.reason(), "");
    const auto light = std::find_if(found.layers.begin(), found.layers.end(),
                                    [](const LayerComparison& l) { return l.layer == "volume"; });
    ASSERT_NE(light, found.layers.end());
    EXPECT_GT(light->compared, cpu.pixelCount() - 10);
    EXPECT_LT(light->largest, measured(1.92e-3));
    // The colours have the light of the same ray, apart from the samples' places in the pixel.
    scene.solids[0].opacity = 0.5;
    scene.meshes[0].opacity = 0.3;
    const Image a = renderCpu(scene, kNoRays), b = renderEmbree(scene, kNoRays);
    double largest = 0;
    for (const char* name : {"R", "G", "B", "A"})
      for (std::size_t i = 0; i < a.pixelCount(); ++i)
        largest = std::max(largest, std::abs(static_cast<double>(a.channels.at(name)[i] -
                                                                 b.channels.at(name)[i])));
    EXPECT_LT(largest, measured(1.7e-3));
    // Another transfer function is found.
    std::vector<TransferPoint> others = points;
    for (TransferPoint& point : others) point.opacity *= 0.9;
    scene.volumePart = partOf(scene.volumePart->volume.volume(), others);
    EXPECT_NE(compareImages(renderCpu(scene, kNoRays), judged).reason().find("volume"),
              std::string::npos);
  }
}

TEST(VolumeScene, WritesTheLightOfTheMiddleOfEachPixel) {
  const Scene scene = mixed(functions()[0]);
  const Image image = renderCpu(scene, kNoRays);
  const CameraRays rays(scene.camera);
  VolumeShading shading;
  const V3d& d = scene.key.direction;  // in camera space
  const V3d back = -rays.axis(), right = scene.camera.up.cross(back).normalized();
  shading.toLight = (right * d.x + back.cross(right) * d.y + back * d.z).normalized();
  std::size_t hit = 0;
  double largest = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const auto i = static_cast<std::size_t>(y * image.width + x);
      const Camera::Ray ray = scene.camera.ray(x + 0.5, y + 0.5);
      const double depth = static_cast<double>(image.channels.at("Z")[i]);
      const VolumeLight light = scene.volumePart->volume.light(
          ray.origin, ray.direction, 0, depth / ray.direction.dot(rays.axis()), &shading);
      hit += std::isfinite(depth);
      for (const auto& [name, value] :
           {std::pair{"volume.R", light.colour.x}, {"volume.A", 1 - light.transmittance}})
        largest =
            std::max(largest, std::abs(static_cast<double>(image.channels.at(name)[i]) - value));
    }
  // The layer Z is in single precision.
  EXPECT_LT(largest, measured(3.78e-7));
  EXPECT_GT(hit, 200u);
  RenderOptions without = kNoRays;
  without.volumeLight = false;
  const Image plain = renderCpu(scene, without);
  EXPECT_FALSE(plain.channels.contains("volume.A"));
  EXPECT_EQ(plain.channels.at("G"), image.channels.at("G"));
  EXPECT_EQ(image.attributes.at("ls:transfer"), transferText(functions()[0]));
}

TEST(VolumeScene, DoesNotDependOnTheNumberOfThreads) {
  const Scene scene = mixed(functions()[0]);
  const Image all = renderCpu(scene);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(all.channels, renderCpu(scene).channels);
}

TEST(VolumeScene, IsFramedWithItsGrid) {
  Scene scene = slab();
  const auto isInFrame = [](const Scene& drawn) {
    const Camera camera = framingCamera(drawn, 80, 80, 0.6, V3d(0, 1, 0));
    Scene seen = drawn;
    seen.camera = camera;
    const Image image = renderCpu(seen, kNoRays);
    for (int n = 0; n < 80; ++n)
      for (const int i : {n, 79 * 80 + n, 80 * n, 80 * n + 79})
        if (image.channels.at("A")[static_cast<std::size_t>(i)] > 0) return false;
    return true;
  };
  EXPECT_TRUE(isInFrame(scene));
  levelset::TriMesh mesh;
  mesh.positions = {{20, 0, 0}, {23, 0, 0}, {20, 3, 0}};
  mesh.triangles = {{0, 1, 2}};
  scene.meshes.push_back({std::make_shared<const levelset::TriMesh>(mesh)});
  EXPECT_TRUE(isInFrame(scene));
}

TEST(VolumeScene, RefusesAGround) {
  Scene scene = slab();
  scene.meshes.push_back({sheet(-1)});
  scene.ground = groundOf(scene, V3d(0, 0, 1));
  EXPECT_THROW((void)renderCpu(scene, kNoRays), levelset::UsageError);
}

class VolumeSceneFile : public testing::Test {
 protected:
  /// A volume of x + 10 z, of 3×4×5 bytes with a spacing of 2, as MetaImage.
  void SetUp() override {
    std::ofstream file(folder_ / "ramp.mha", std::ios::binary);
    file << "ObjectType = Image\nNDims = 3\nBinaryData = True\nDimSize = 3 4 5\n"
            "ElementSpacing = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
    for (int n = 0; n < 60; ++n) file << static_cast<char>(n % 3 + 10 * (n / 12));
    levelset::writeMesh(folder_ / "sheet.ply", *sheet(3), {});
  }
  [[nodiscard]] ViewedScene read(const std::string& volumes, const std::string& meshes = "[]") {
    std::ofstream(folder_ / "scene.json")
        << R"({"format": "levelsmith scene", "version": 1, "meshes": )" << meshes
        << R"(, "volumes": )" << volumes << "}";
    return readScene(folder_ / "scene.json");
  }

  support::TemporaryFolder folder_;
};

TEST_F(VolumeSceneFile, HoldsAVolumeWithItsTransferFunction) {
  const std::string ramp = R"("name": "ramp", "file": "ramp.mha", "transfer": "0:0 40:0.1/1,0,0")";
  const ViewedScene plain = read("[{" + ramp + "}]");
  ASSERT_TRUE(plain.scene.volumePart);
  const VolumePart& part = *plain.scene.volumePart;
  EXPECT_EQ(part.name, "ramp");
  EXPECT_TRUE(part.isShaded);
  EXPECT_EQ(part.volume.transfer().points(), parseTransfer("0:0 40:0.1/1,0,0"));
  EXPECT_EQ(part.volume.volume().at(2, 3, 4), 42);
  EXPECT_EQ(part.volume.bounds().size(), V3d(4, 6, 8));
  const ViewedScene moved = read(
      "[{" + ramp + R"(, "shading": false, "transform": [1,0,0,0, 0,0.5,0,0, 0,0,1,0, 5,6,7,1]}])",
      R"([{"name": "sheet", "file": "sheet.ply"}])");
  EXPECT_FALSE(moved.scene.volumePart->isShaded);
  EXPECT_EQ(moved.scene.meshes.size(), 1u);
  EXPECT_EQ(moved.scene.volumePart->volume.bounds().size(), V3d(4, 3, 8));
  EXPECT_LT((moved.scene.volumePart->volume.bounds().min -
             (part.volume.bounds().min * V3d(1, 0.5, 1) + V3d(5, 6, 7)))
                .length(),
            1e-12);
  EXPECT_THROW(writeScene(folder_ / "again.json", moved), levelset::UsageError);
}

TEST_F(VolumeSceneFile, RefusesWhatItCannotDraw) {
  const auto refused = [&](const std::string& volumes, const std::string& word) {
    try {
      (void)read(volumes);
      ADD_FAILURE() << volumes;
    } catch (const levelset::InvalidInput& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  const std::string file = R"("name": "ramp", "file": "ramp.mha")";
  const std::string good = file + R"(, "transfer": "0:0 40:0.1")";
  refused("[]", "no parts");
  refused("{}", "no parts");
  refused("[{" + good + "}, {" + good + "}]", "can have one");
  refused("[{" + file + "}]", "transfer");
  refused("[{" + file + R"(, "transfer": "40"}])", "VALUE:OPACITY");
  refused("[{" + file + R"(, "transfer": "40:1"}])", "less than 1");
  refused("[{" + good + R"(, "shading": 1}])", "shading");
  refused("[{" + good + R"(, "opacity": 1}])", "opacity");
  refused("[{" + good + R"(, "frame": -1}])", "frame");
  refused("[{" + good + R"(, "transform": [1,0,0,0, 0,1,0,0, 0,0,0,0, 0,0,0,1]}])", "not valid");
  refused("[{" + good + R"(, "transform": [1,0,0,1, 0,1,0,0, 0,0,1,0, 0,0,0,1]}])", "column");
  refused(R"([{"name": "ramp", "file": "sheet.ply", "transfer": "0:0.1"}])", "header");
  refused(R"([{"name": "a b", "file": "ramp.mha", "transfer": "0:0.1"}])", "a b");
}

}  // namespace volume_scene_test
