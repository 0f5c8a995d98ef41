// Measures the cost of one patch among many. Maps equal studs on equal patches of a sphere: one at
// a time, ten at once and a hundred at once, on one thread.
//
//   scatter_bench
//
// Exits 1 when each of the patches 11 to 100 costs more than 1.2 times as much as the first. The
// cost includes construction of the patch, mapping, and union with the base.

#include <fmt/core.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <ctime>

#include "levelset/shapes/shapes.h"
#include "mapping/placement/scatter.h"
#include "mapping/textures/geometric_texture.h"

namespace {

using Imath::V3d;

/// CPU seconds.
double now() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

}  // namespace

int main() {
  const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  constexpr double kVoxel = 0.1;
  const levelset::NarrowBand base = levelset::makeSphere(8, V3d(0), kVoxel);
  const levelset::NarrowBand stud = levelset::makeSphere(0.8, V3d(0), kVoxel);
  mapping::ScatterOptions options = {
      .density = {.count = 1}, .uSize = 1.6, .vSize = 1.6, .patch = {.layers = 3, .spacing = 0.25}};
  const auto costOf = [&](std::size_t count) {
    options.density.count = count;
    double start = now();
    const mapping::ScatterResult strewn = mapping::scatter(base, 1.6, options);
    const double patches = now() - start;
    start = now();
    (void)mapping::mapTexture(base, stud, strewn.patches, {.voxelSize = kVoxel});
    const double mapped = now() - start;
    fmt::print("{:>3} patches: strewn in {:.2f} s, mapped in {:.2f} s\n", strewn.patches.size(),
               patches, mapped);
    return patches + mapped;
  };
  const double first = costOf(1), ten = costOf(10), hundred = costOf(100);
  const double later = (hundred - ten) / 90, each = hundred / 100;
  fmt::print(
      "from the eleventh on {:.3f} s each; the hundredth costs {:.2f} of the first (1.2 at "
      "most), {:.2f} of one of the first ten; all hundred {:.2f} each, shared work with them\n",
      later, later / first, later / (ten / 10), each / first);
  return std::max(later, each) <= 1.2 * first ? 0 : 1;
}
