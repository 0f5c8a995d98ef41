// What a patch costs for being one of many: equal studs on equal patches of a sphere, laid one by
// one, ten at once and a hundred at once, on one thread.
//   scatter_bench
// Exits 1 when the patches from the eleventh to the hundredth cost more than 1.2 times as much each
// as the first one does, making the patch, mapping and joining with the base included.

#include <fmt/core.h>
#include <tbb/global_control.h>

#include <ctime>
#include <span>

#include "levelset/solids/shapes.h"
#include "mapping/patches/scatter.h"
#include "mapping/textures/geometric_texture.h"

namespace {

using Imath::V3d;

/// CPU seconds.
double now() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

struct Cost {
  double patches = 0, mapping = 0;  ///< CPU seconds
};

}  // namespace

int main() {
  const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  constexpr double kVoxel = 0.05;
  const levelset::NarrowBand base = levelset::makeSphere(8, V3d(0), kVoxel);
  const levelset::NarrowBand stud = levelset::makeSphere(0.8, V3d(0), kVoxel);
  mapping::ScatterOptions options = {
      .density = {.count = 100}, .uSize = 1.6, .vSize = 1.6, .patch = {.levels = 4}};
  double start = now();
  const mapping::ScatterResult strewn = mapping::scatter(base, 1.6, options);
  const double perPatch = (now() - start) / static_cast<double>(strewn.patches.size());
  fmt::print("{} patches, {:.3f} s each\n", strewn.patches.size(), perPatch);
  const auto costOf = [&](std::size_t count) {
    start = now();
    (void)mapping::mapTexture(base, stud, std::span(strewn.patches).first(count),
                              {.voxelSize = kVoxel});
    const double seconds = now() - start;
    fmt::print("texture on {:>3}: {:.2f} s\n", count, seconds);
    return seconds;
  };
  const double first = costOf(1), ten = costOf(10), hundred = costOf(100);
  const double later = (hundred - ten) / 90;
  const double ratio = (perPatch + later) / (perPatch + first);
  fmt::print(
      "from the eleventh on {:.3f} s each; the hundredth costs {:.2f} of the first (1.2 at "
      "most), {:.2f} of one of the first ten\n",
      later, ratio, (perPatch + later) / (perPatch + ten / 10));
  return ratio <= 1.2 ? 0 : 1;
}
