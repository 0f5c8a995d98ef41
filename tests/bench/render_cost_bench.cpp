// Measures the cost of primary rays of the kernel, in CPU seconds of one thread, against three
// sizes. These are the pixels of the picture, the size of a ball, and the length of outlines. The
// ball's surface grows with the square of its size, its volume with the cube. Outlines come from
// one, four, sixteen, … balls in the same frame. Exits 1 when a ball of 4096 times the volume costs
// more than four times as much, or when cost grows faster than the number of pixels.
//
//   render_cost_bench > render-cost.csv

#include <fmt/core.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/shapes/shapes.h"
#include "render/cpu/cpu_tracer.h"
#include "render/kernel/kernel_scene.h"

namespace {

using Imath::V3d;
using levelset::NarrowBand;
using namespace render;

constexpr int kTile = 16;

double cpuSeconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// Least of three runs.
double secondsOf(const NarrowBand& band, int pixels) {
  Scene scene;
  scene.solids.push_back({.band = band});
  scene.camera = framingCamera(band.zeroSetBounds(), pixels, pixels);
  const KernelScene surfaces(scene);
  const CpuTracer tracer;
  double least = HUGE_VAL;
  for (int n = 0; n < 3; ++n) {
    const double start = cpuSeconds();
    for (int top = 0; top < pixels; top += kTile)
      for (int left = 0; left < pixels; left += kTile) {
        PixelBlock block(kTile * kTile);
        for (int i = 0; i < kTile * kTile; ++i) {
          // Squares of four pixels, in the renderer's order.
          const int square = i / 16, x = left + square % 4 * 4 + i % 4,
                    y = top + square / 4 * 4 + i / 4 % 4;
          block.x[static_cast<std::size_t>(i)] = static_cast<float>(x + 0.5 - 0.5 * pixels);
          block.y[static_cast<std::size_t>(i)] = static_cast<float>(y + 0.5 - 0.5 * pixels);
        }
        (void)surfaces.castPixels(tracer, block);
      }
    least = std::min(least, cpuSeconds() - start);
  }
  return least;
}

/// n × n balls in a square of 256 voxels that spans the view.
NarrowBand ballsOf(int n) {
  std::vector<NarrowBand> balls;
  const double step = 256.0 / n;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      balls.push_back(levelset::makeSphere(
          0.45 * step, V3d((i + 0.5) * step - 128, (j + 0.5) * step - 128, 0.1), 1));
  if (balls.size() == 1) return balls.front();
  return levelset::combine(levelset::CsgOperation::Union, balls).band;
}

}  // namespace

int main() {
  const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  fmt::print("series,pixels,size,active_voxels,cpu_s\n");
  const auto tell = [](const char* series, int pixels, double size, const NarrowBand& band) {
    const double seconds = secondsOf(band, pixels);
    fmt::print("{},{},{},{},{:.4g}\n", series, static_cast<long>(pixels) * pixels, size,
               band.activeVoxelCount(), seconds);
    std::fflush(stdout);
    return seconds;
  };
  const NarrowBand ball = levelset::makeSphere(100, V3d(0.3, 0.2, 0.1), 1);
  double first = 0, last = 0;
  for (const int pixels : {256, 512, 1024, 2048}) {
    last = tell("pixels", pixels, 100, ball);
    if (pixels == 256) first = last;
  }
  const bool isProportional = last <= 1.2 * 64 * first;
  for (const double radius : {25.0, 50.0, 100.0, 200.0, 400.0}) {
    last = tell("radius", 512, radius, levelset::makeSphere(radius, V3d(0.3, 0.2, 0.1), 1));
    if (radius == 25) first = last;
  }
  const bool isFlat = last <= 4 * first;
  for (const int n : {1, 2, 4, 8, 16}) (void)tell("balls", 512, n, ballsOf(n));
  return isProportional && isFlat ? 0 : 1;
}
