// Measures the ray caster on isosurfaces of volumes: the ranges of blocks, which are made once; the
// blocks and tables of another isovalue; and primary rays of the default view at 1024x768, for each
// filter. Reports CPU seconds of one thread, and the blocks and cells that the tables hold. With
// `gpu`, also the rays a second of the compute shader, and the rays with other hits than the
// processor's.
//
//   volume_bench sphere|marschner-lobb SIZE [gpu]    a table on standard output: NAME VALUE
//   volume_bench FILE ISOVALUE [gpu]                 the same of a volume from a file

#include <fmt/core.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <ctime>
#include <memory>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "levelset/volume_files/volume_file.h"
#include "levelset/volumes/synthetic.h"
#include "render/cpu/cpu_tracer.h"
#include "render/gpu/device/gl_context.h"
#include "render/gpu/gpu_tracer.h"
#include "render/kernel/kernel_scene.h"
#include "render/volumes/volume_surface.h"

namespace {

using namespace render;

constexpr int kWidth = 1024, kHeight = 768, kSquare = 4;

double cpuSeconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// Least CPU seconds of three runs.
template <typename Job>
double timeOf(const Job& job) {
  double least = HUGE_VAL;
  for (int i = 0; i < 3; ++i) {
    const double start = cpuSeconds();
    job();
    least = std::min(least, cpuSeconds() - start);
  }
  return least;
}

void tell(const std::string& name, double value) {
  fmt::print("{} {:.4g}\n", name, value);
}

constexpr std::size_t kRays = std::size_t{kWidth} * kHeight;
constexpr std::size_t kFew = 1u << 12;  // few enough for the processor's cache

/// All pixels of the picture, as squares of neighbouring pixels.
/// @param atOnce  pixels of a block; divides kRays
std::vector<PixelBlock> allPixels(std::size_t atOnce) {
  std::vector<PixelBlock> all(kRays / atOnce, PixelBlock(atOnce));
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

/// Reports the compute shader's rays a second, alone and with the transfers of a picture, and the
/// rays whose solid or depth differs from the processor's.
void benchmarkGpu(const GlContext& context, const KernelScene& surfaces, const std::string& name) {
  const PixelBlock pixels = allPixels(kRays)[0];
  const GpuTracer tracer(context, surfaces);
  (void)surfaces.castPixels(tracer, pixels);  // compiles the shader
  double shader = HUGE_VAL, wall = HUGE_VAL;
  PixelHits hits(0);
  for (int run = 0; run < 3; ++run) {
    const double shaderStart = tracer.shaderSeconds();
    const auto start = std::chrono::steady_clock::now();
    hits = surfaces.castPixels(tracer, pixels);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    shader = std::min(shader, tracer.shaderSeconds() - shaderStart);
    wall = std::min(wall, taken.count());
  }
  tell(name + "_gpu_mrays_per_s_of_shader", 1e-6 * kRays / shader);
  tell(name + "_gpu_mrays_per_s_with_transfers", 1e-6 * kRays / wall);
  const PixelHits expected = surfaces.castPixels(CpuTracer(), pixels);
  std::size_t different = 0;
  for (std::size_t n = 0; n < kRays; ++n)
    different += hits.solid[n] != expected.solid[n] ||
                 (hits.solid[n] >= 0 && hits.depth[n] != expected.depth[n]);
  tell(name + "_gpu_different", static_cast<double>(different));
}

/// @param context  the compute shader is measured if it is given
void benchmark(const levelset::Volume& volume, double isovalue, const GlContext* context) {
  const double start = cpuSeconds();
  const VolumeSurface surface(volume, isovalue + 1e-3 * (volume.highest() - volume.lowest()));
  tell("ranges_s", cpuSeconds() - start);
  Scene scene;
  scene.solids.push_back({.band = {}});
  const std::vector<PixelBlock> pixels = allPixels(kFew);
  for (const Filter filter : kFilters) {
    const std::string name = filterName(filter);
    const auto other = std::make_shared<const VolumeSurface>(surface.withIsovalue(isovalue));
    tell(name + "_blocks_s", timeOf([&] { (void)other->blocks(filter); }));
    scene.solids[0].volume = other;
    scene.camera = framingCamera(scene, kWidth, kHeight, scene.camera.verticalFov, scene.camera.up);
    tell(name + "_tables_s", timeOf([&] { (void)makeBricks(*other, {.filter = filter}); }));
    const BrickPool pool = makeBricks(*other, {.filter = filter});
    std::size_t cells = 0;
    for (const std::uint32_t word : pool.mask)
      cells += static_cast<std::size_t>(std::popcount(word));
    tell(name + "_stored_blocks", static_cast<double>(pool.brickCount()));
    tell(name + "_cells", static_cast<double>(cells));
    const KernelScene surfaces(scene, levelset::kNoMemoryLimit, filter);
    tell(name + "_table_mb", static_cast<double>(surfaces.bytes()) / 1e6);
    const CpuTracer tracer;
    std::size_t found = 0;
    const double seconds = timeOf([&] {
      found = 0;
      for (const PixelBlock& block : pixels) {
        const PixelHits hits = surfaces.castPixels(tracer, block);
        found += static_cast<std::size_t>(
            std::count_if(hits.solid.begin(), hits.solid.end(), [](int s) { return s >= 0; }));
      }
    });
    tell(name + "_hits", static_cast<double>(found));
    tell(name + "_mrays_per_s", 1e-6 * kRays / seconds);
    if (context != nullptr) benchmarkGpu(*context, surfaces, name);
  }
}

}  // namespace

int main(int argc, char** argv) try {
  const bool hasGpu = argc == 4 && argv[3] == std::string("gpu");
  if (argc != 3 && !hasGpu) {
    fmt::print(stderr,
               "usage: volume_bench sphere|marschner-lobb SIZE [gpu], or FILE ISOVALUE [gpu]\n");
    return 2;
  }
  const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  std::unique_ptr<const GlContext> context;
  if (hasGpu) {
    context = std::make_unique<const GlContext>();
    fmt::print("gpu {}\n", context->description());
  }
  const std::string form = argv[1];
  if (form == "sphere")
    benchmark(levelset::sphereVolume(std::stoi(argv[2]), 0.8), 0, context.get());
  else if (form == "marschner-lobb")
    benchmark(levelset::marschnerLobb(std::stoi(argv[2])), 0.5, context.get());
  else
    benchmark(levelset::readVolume(form), std::stod(argv[2]), context.get());
  return 0;
} catch (const levelset::Error& error) {
  fmt::print(stderr, "volume_bench: {}\n", error.what());
  return 1;
}
