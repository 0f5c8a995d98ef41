// Soft expressions and morphs by the compute shader: equal bits as by the processor, and limits.

#include "render/gpu/gpu_fields.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/transform.h"
#include "render/cpu/cpu_renderer.h"
#include "render/cpu/cpu_tracer.h"
#include "render/gpu/device/gl_context.h"
#include "render/gpu/gpu_renderer.h"
#include "render/gpu/gpu_tracer.h"
#include "render/images/compare_images.h"
#include "render/kernel/kernel_scene.h"
#include "tests/support/bands.h"
#include "tests/support/field_scenes.h"
#include "tests/support/render_scenes.h"

namespace gpu_fields_test {

using namespace support::fields;

const NarrowBand& ball() {
  static const NarrowBand band = levelset::makeSphere(12, V3d(0.1, 0.2, 0.3), 1, {.halfWidth = 4});
  return band;
}

/// A turned box on a finer grid.
const NarrowBand& block() {
  static const NarrowBand band =
      levelset::transform(levelset::makeBox(V3d(14, 11, 18), V3d(6, 4, 7), 0.7, {.halfWidth = 6}),
                          Imath::M44d().rotate(V3d(0.3, 0.5, 0.2)));
  return band;
}

const NarrowBand& ring() {
  static const NarrowBand band = levelset::transform(
      levelset::makeTorus(9, 3, V3d(4, -5, 6), V3d(0, 0, 1), 0.5, {.halfWidth = 8}),
      Imath::M44d().rotate(V3d(-0.4, 0.2, 0.7)));
  return band;
}

/// Draws the scene by both renderers, lit and with thickness, and expects equal bits.
/// @param samples  with 4 or more, light is interpolated between the points of a lattice
void expectEqualBits(const Scene& scene, const std::string& what, int samples = 1) {
  RenderOptions options = {.samples = samples, .ambientSamples = 2, .shadowSamples = 4};
  options.thickness = true;
  const Image gpu = renderGpu(scene, options), cpu = renderCpu(scene, options);
  const ImageComparison found = compareImages(gpu, cpu, {.exact = true});
  EXPECT_GT(found.bothHit, 300u) << what;
  EXPECT_EQ(found.differentBits, 0u) << what << ": " << found.reason();
  EXPECT_TRUE(found.agrees()) << what;
  EXPECT_EQ(gpu.channels.at("thickness"), cpu.channels.at("thickness")) << what;
}

TEST(GpuFields, HaveTheBitsOfTheProcessorForSoftExpressions) {
  for (const char* csg : {"a | b", "a - b"})
    expectEqualBits(blended({ball(), block()}, csg, 2.5, 64, 48), csg, 4);
  expectEqualBits(blended({ball(), block(), ring()}, "c - (a & b) | b", 2, 64, 48), "nested");
}

TEST(GpuFields, HaveTheBitsOfTheProcessorForMorphs) {
  for (const double share : {0.0, 0.3, 0.5, 1.0})
    expectEqualBits(morphed(ball(), ring(), share, 64, 48), std::to_string(share));
}

TEST(GpuFields, HaveTheBitsOfTheProcessorFromInsideFarAndAlongTheLattice) {
  Scene scene = blended({ball(), block()}, "a | b", 3, 64, 48);
  const Camera outside = scene.camera;
  scene.camera.from = V3d(0.3, 2.2, -3.1);
  scene.camera.to = V3d(20, 30, 11);
  expectEqualBits(scene, "from within");
  scene.camera = outside;
  scene.camera.from = outside.to + (outside.from - outside.to).normalized() * 1e5;
  scene.camera.verticalFov = 1.2 * scene.bounds().size().length() / 1e5;
  expectEqualBits(scene, "from far");
  const NarrowBand box = levelset::makeBox(V3d(32, 24, 16), V3d(0), 1, {.halfWidth = 4}),
                   fine = levelset::makeBox(V3d(12, 30, 8), V3d(8, 4, 6), 0.5, {.halfWidth = 8});
  scene = blended({box, fine}, "a | b", 2);
  scene.camera = support::alongTheLattice(box, V3d(0, 60, 0)).camera;
  expectEqualBits(scene, "along the lattice");
}

TEST(GpuFields, AreCutAtDepthsAndSeenThroughMeshes) {
  Scene scene = blended({ball(), block()}, "a - b", 2, 64, 48);
  levelset::TriMesh sheet;
  sheet.positions = {{-40, -40, 13}, {40, -40, 13}, {40, 40, 13}, {-40, 40, 13}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.meshes = {
      {std::make_shared<const levelset::TriMesh>(sheet), {0.1f, 0.2f, 0.7f}, 9, "sheet", 0.4}};
  const double away = (scene.camera.to - scene.camera.from).length();
  scene.camera.near = 0.95 * away;
  scene.camera.far = 1.1 * away;
  expectEqualBits(scene, "mesh and depths");
}

/// A scene in which the searches start, and both tracers.
struct Searches {
  Scene scene;
  KernelScene surfaces;
  GlContext context;
  GpuTracer gpu;
  CpuTracer cpu;

  explicit Searches(Scene from) : scene(std::move(from)), surfaces(scene), gpu(context, surfaces) {}

  /// Compares the answers for the rays bit by bit. Returns the number of rays with an answer.
  std::size_t expectEqual(const std::vector<FieldRay>& rays) const {
    const FieldTraversal& fields = *surfaces.fields();
    const std::vector<double> lengths = fields.thickness(gpu, rays);
    EXPECT_EQ(lengths, fields.thickness(cpu, rays));
    const std::vector<Hit> ours = fields.intersect(gpu, rays), theirs = fields.intersect(cpu, rays);
    std::size_t found = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      found += theirs[i].found && lengths[i] > 0;
      EXPECT_EQ(ours[i].found, theirs[i].found);
      EXPECT_EQ(ours[i].distance, theirs[i].distance);
    }
    EXPECT_EQ(fields.areOccluded(gpu, rays), fields.areOccluded(cpu, rays));
    return found;
  }
};

std::vector<FieldRay> raysThrough(double radius, std::size_t count) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> even(-radius, radius);
  const auto point = [&] {
    const double x = even(random), y = even(random);
    return V3d(x, y, even(random));
  };
  std::vector<FieldRay> rays;
  while (rays.size() < count) {
    const V3d from = point();
    rays.push_back({from, (point() - from).normalized(), 0, 4 * radius});
  }
  return rays;
}

TEST(GpuFields, FindTheCrossingsOfNoise) {
  // Cells with several sheets each, and slopes far from 1.
  std::mt19937 random(5);
  std::uniform_real_distribution<double> even(-1, 1);
  const NarrowBand noise = support::sampleBand(
      [&](const V3d& p) {
        const double value = even(random);
        return p.length() < 9 ? value : 4;
      },
      Imath::Box3d(V3d(-10), V3d(10)), 1);
  for (const char* csg : {"a | b", "a - b"}) {
    const Searches searches(blended({levelset::makeSphere(8, V3d(3, 2, 1), 0.7), noise}, csg, 0.8));
    EXPECT_GT(searches.expectEqual(raysThrough(12, 1500)), 700u) << csg;
  }
}

TEST(GpuFields, AreSearchedAlongRaysOfThousandsOfSteps) {
  // The rays stay within a voxel of the surface of a long box, so that each cell is searched.
  const NarrowBand rod = levelset::makeBox(V3d(700, 8, 8), V3d(0), 1, {.halfWidth = 4}),
                   other = levelset::makeBox(V3d(690, 8, 8), V3d(0, 0, 1), 1, {.halfWidth = 4});
  const Searches searches(blended({rod, other}, "a | b", 2));
  std::vector<FieldRay> rays;
  for (int n = 0; n < 60; ++n)
    rays.push_back(
        {V3d(-360, 4.2 + 0.01 * n, 0.1), V3d(1, 1e-4 * n - 3e-3, 0).normalized(), 0, 720});
  EXPECT_GT(searches.expectEqual(rays), 10u);
}

TEST(GpuFields, FollowMovedSolids) {
  Searches searches(blended({ball(), block()}, "a | b", 2));
  const std::vector<FieldRay> rays = raysThrough(20, 300);
  EXPECT_GT(searches.expectEqual(rays), 50u);
  const double before = searches.surfaces.fields()->thickness(searches.gpu, rays)[0];
  searches.scene.solids[0].band = levelset::transform(
      searches.scene.solids[0].band, Imath::M44d().setTranslation(V3d(3.3, 1.1, -2.2)));
  searches.surfaces.updateView(searches.scene);
  EXPECT_GT(searches.expectEqual(rays), 50u);
  EXPECT_NE(searches.surfaces.fields()->thickness(searches.gpu, rays)[0], before);
}

std::string refusalOf(const Scene& scene) {
  try {
    const Searches searches(scene);
  } catch (const levelset::ResourceLimit& error) {
    return error.what();
  }
  return "accepted";
}

TEST(GpuFields, RefuseLongExpressions) {
  const NarrowBand small = levelset::makeSphere(4, V3d(0), 1);
  const auto soft = [&](std::size_t solids, std::size_t steps) {
    std::string csg = "a";
    for (std::size_t n = 1; n <= steps; ++n)
      csg += std::string(" | ") + static_cast<char>('a' + n % solids);
    return blended(std::vector<NarrowBand>(solids, small), csg, 0.1, 8, 8);
  };
  EXPECT_EQ(refusalOf(soft(GpuFields::kMostFields, GpuFields::kMostJoins)), "accepted");
  const Scene wide = soft(GpuFields::kMostFields + 1, GpuFields::kMostFields),
              deep = soft(2, GpuFields::kMostJoins + 1);
  EXPECT_NE(refusalOf(wide).find("has 9 solids"), std::string::npos) << refusalOf(wide);
  EXPECT_NE(refusalOf(deep).find("has 25 soft operations"), std::string::npos) << refusalOf(deep);
  for (const Scene& scene : {wide, deep}) {
    EXPECT_NE(refusalOf(scene).find("--renderer cpu"), std::string::npos);
    EXPECT_THROW((void)renderGpu(scene, kDataOnly), levelset::ResourceLimit);
  }
}

}  // namespace gpu_fields_test
