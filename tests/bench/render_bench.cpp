// Measures primary rays of a band's default view at 1024x768. Reports CPU seconds of the kernel on
// one thread, of the kernel on the GPU, and of the judge, and the memory of the tables. With Mesa's
// llvmpipe in place of a GPU, its seconds are CPU time too. render.sh compares them with
// vdb_render.
//
//   render_bench FILE.vdb            a table on standard output: NAME VALUE
//   render_bench --view FILE.vdb     the view, as vdb_render takes it

#include <fmt/core.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <tbb/global_control.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <ctime>
#include <numbers>
#include <string>

#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/vdb.h"
#include "render/cpu/cpu_renderer.h"
#include "render/cpu/cpu_tracer.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/device/gl_context.h"
#include "render/gpu/gpu_tracer.h"
#include "render/kernel/kernel_scene.h"

namespace {

using namespace render;

constexpr int kWidth = 1024, kHeight = 768, kSquare = 4;
constexpr double kRays = static_cast<double>(kWidth) * kHeight;

double cpuSeconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

// Rays per call on the processor, few enough for its cache.
constexpr std::size_t kAtOnce = 1u << 12;

/// All pixels of the picture in blocks of `atOnce`, as squares of neighbouring pixels.
std::vector<PixelBlock> allPixels(std::size_t atOnce) {
  const std::size_t blocks = static_cast<std::size_t>(kRays) / atOnce;
  std::vector<PixelBlock> all(blocks, PixelBlock(atOnce));
  std::size_t n = 0;
  for (int top = 0; top < kHeight; top += kSquare)
    for (int left = 0; left < kWidth; left += kSquare)
      for (int y = top; y < top + kSquare; ++y)
        for (int x = left; x < left + kSquare; ++x, ++n) {
          all[n / atOnce].x[n % atOnce] = static_cast<float>(x + 0.5 - 0.5 * kWidth);
          all[n / atOnce].y[n % atOnce] = static_cast<float>(y + 0.5 - 0.5 * kHeight);
        }
  return all;
}

/// Least CPU seconds of three runs.
template <typename Job>
double timeOf(const Job& job) {
  double least = 1e300;
  for (int i = 0; i < 3; ++i) {
    const double start = cpuSeconds();
    job();
    least = std::min(least, cpuSeconds() - start);
  }
  return least;
}

void tell(const char* name, double value) {
  fmt::print("{} {:.4g}\n", name, value);
}

void benchmark(const Scene& scene) {
  const levelset::NarrowBand& band = scene.solids[0].band;
  const double voxels = static_cast<double>(band.activeVoxelCount());
  const double start = cpuSeconds();
  const KernelScene surfaces(scene);
  tell("prepare_s_per_million_voxels", (cpuSeconds() - start) / voxels * 1e6);
  const double nano = static_cast<double>(nanovdb::openToNanoVDB(levelset::vdb(band)).size());
  const BrickPool& pool = surfaces.solids()[0].pool;
  const std::size_t beside = (pool.value.size() - pool.brickCount() * BrickPool::kValues) * 4;
  tell("crossed_of_nanovdb", static_cast<double>(pool.bytes() - beside) / nano);
  tell("tables_of_nanovdb", static_cast<double>(surfaces.bytes()) / nano);

  const std::vector<PixelBlock> few = allPixels(kAtOnce);
  tell("cpu_mrays_per_s", 1e-6 * kRays / timeOf([&] {
                            for (const PixelBlock& block : few)
                              (void)surfaces.castPixels(CpuTracer(), block);
                          }));
  try {
    const GlContext context;
    const GpuTracer tracer(context, surfaces);
    const PixelBlock pixels = allPixels(static_cast<std::size_t>(kRays))[0];
    (void)surfaces.castPixels(tracer, pixels);  // compiles the shader
    tell("gpu_mrays_per_cpu_s",
         1e-6 * kRays / timeOf([&] { (void)surfaces.castPixels(tracer, pixels); }));
    const double shaderStart = tracer.shaderSeconds();
    const auto begin = std::chrono::steady_clock::now();
    (void)surfaces.castPixels(tracer, pixels);
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
    tell("gpu_mrays_per_s_with_transfers", 1e-6 * kRays / wall.count());
    tell("gpu_mrays_per_s_of_shader", 1e-6 * kRays / (tracer.shaderSeconds() - shaderStart));
    fmt::print("gpu {}\n", context.description());
  } catch (const levelset::ResourceLimit& error) {
    fmt::print(stderr, "{}\n", error.what());
  }
  const double splineStart = cpuSeconds();
  const KernelScene splines(scene, levelset::kNoMemoryLimit, Filter::BSplineQi);
  tell("spline_prepare_s_per_million_voxels", (cpuSeconds() - splineStart) / voxels * 1e6);
  tell("spline_tables_of_nanovdb", static_cast<double>(splines.bytes()) / nano);
  tell("spline_cpu_mrays_per_s", 1e-6 * kRays / timeOf([&] {
                                   for (const PixelBlock& block : few)
                                     (void)splines.castPixels(CpuTracer(), block);
                                 }));
  const EmbreeScene judge(scene);
  tell("embree_mrays_per_s", 1e-6 * kRays / timeOf([&] {
                               for (int y = 0; y < kHeight; ++y)
                                 for (int x = 0; x < kWidth; ++x) {
                                   const Camera::Ray ray = scene.camera.ray(x + 0.5, y + 0.5);
                                   (void)judge.intersect(ray.origin, ray.direction);
                                 }
                             }));
  const RenderOptions plain = {.samples = 1, .ambientSamples = 0, .shadowSamples = 0};
  tell("cpu_all_layers_s", timeOf([&] { (void)renderCpu(scene, plain); }));
}

}  // namespace

int main(int argc, char** argv) try {
  const bool isView = argc == 3 && std::strcmp(argv[1], "--view") == 0;
  if (argc != 2 && !isView) {
    fmt::print(stderr, "render_bench [--view] FILE.vdb\n");
    return 2;
  }
  const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  Scene scene;
  scene.solids.push_back({.band = levelset::readBand(argv[argc - 1])});
  scene.camera = framingCamera(scene.solids[0].band.zeroSetBounds(), kWidth, kHeight);
  if (isView) {
    const Camera& c = scene.camera;
    const double across =
        2 * std::atan(std::tan(c.verticalFov / 2) * kWidth / kHeight) * 180 / std::numbers::pi;
    fmt::print("-translate {},{},{} -lookat {},{},{} -fov {}\n", c.from.x, c.from.y, c.from.z,
               c.to.x, c.to.y, c.to.z, across);
    return 0;
  }
  benchmark(scene);
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "{}\n", error.what());
  return 1;
}
