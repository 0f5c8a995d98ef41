// Measures the ray caster on isosurfaces of volumes: the ranges of blocks, which are made once; the
// blocks and tables of another isovalue; and primary rays of the default view at 1024x768, for each
// filter. Reports CPU seconds of one thread, and the blocks and cells that the tables hold.
//
//   volume_bench sphere|marschner-lobb SIZE    a table on standard output: NAME VALUE
//   volume_bench FILE ISOVALUE                 the same of a volume from a file

#include <fmt/core.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <ctime>
#include <memory>
#include <string>

#include "levelset/error.h"
#include "levelset/volume_files/volume_file.h"
#include "levelset/volumes/synthetic.h"
#include "render/cpu/cpu_tracer.h"
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

/// All pixels of the picture, as squares of neighbouring pixels.
std::vector<PixelBlock> allPixels() {
  constexpr std::size_t kAtOnce = 1u << 12;  // few enough for the cache
  std::vector<PixelBlock> all(std::size_t{kWidth} * kHeight / kAtOnce, PixelBlock(kAtOnce));
  std::size_t n = 0;
  for (int top = 0; top < kHeight; top += kSquare)
    for (int left = 0; left < kWidth; left += kSquare)
      for (int y = top; y < top + kSquare; ++y)
        for (int x = left; x < left + kSquare; ++x, ++n) {
          all[n / kAtOnce].x[n % kAtOnce] = static_cast<float>(x + 0.5 - 0.5 * kWidth);
          all[n / kAtOnce].y[n % kAtOnce] = static_cast<float>(y + 0.5 - 0.5 * kHeight);
        }
  return all;
}

void benchmark(const levelset::Volume& volume, double isovalue) {
  const double start = cpuSeconds();
  const VolumeSurface surface(volume, isovalue + 1e-3 * (volume.highest() - volume.lowest()));
  tell("ranges_s", cpuSeconds() - start);
  Scene scene;
  scene.solids.push_back({.band = {}});
  const std::vector<PixelBlock> pixels = allPixels();
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
    tell(name + "_mrays_per_s", 1e-6 * kWidth * kHeight / seconds);
  }
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) {
    fmt::print(stderr, "usage: volume_bench sphere|marschner-lobb SIZE, or FILE ISOVALUE\n");
    return 2;
  }
  const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  const std::string form = argv[1];
  if (form == "sphere")
    benchmark(levelset::sphereVolume(std::stoi(argv[2]), 0.8), 0);
  else if (form == "marschner-lobb")
    benchmark(levelset::marschnerLobb(std::stoi(argv[2])), 0.5);
  else
    benchmark(levelset::readVolume(form), std::stod(argv[2]));
  return 0;
} catch (const levelset::Error& error) {
  fmt::print(stderr, "volume_bench: {}\n", error.what());
  return 1;
}
