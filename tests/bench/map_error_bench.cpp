// Measures error against run time of four methods that map grid points: the direct sum of an RBF
// map, its fast sum, tetrahedra, and the local sum of a compact kernel with a support of four mean
// particle spacings, solved by sparse factors. Maps 10⁶ to 10⁸ grid points of a third of a
// cylinder's wall with 10³ to 10⁵ particles. Mapping uses one thread, solving all threads. The
// error is that of the complete map, against the exact inverse of the map that placed the
// particles. Prints the 99th percentile and the maximum over 2000 positions well inside. Direct
// sums above 10⁴ particles × 10⁷ points are timed on a sample of the blocks, and marked. Exits 1
// when the fast sum differs from the direct sum by more than 0.05 texture voxel at any point that
// both evaluate.
//
//   map_error_bench [POINTS = 100000000 [PARTICLES [VARIANTS]]] > docs/figures/map-error.csv
//   docs/cases/figures.py plot docs/figures/map-error.csv docs/plots/map-error
//
// Without PARTICLES it measures 1000, 10000 and 100000. VARIANTS is a list without blanks, as
// compact,shell; without it all four are measured. A list without `direct` or `fast` does not
// compare their sums.
//
// The first columns are those of the result files that tests/figures.py reads. The column
// resolution has the nominal numbers of particles and points, as 1e4x1e7.

#include <fmt/core.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "mapping/maps/prism_map.h"
#include "mapping/placement/make_patch.h"
#include "mapping/textures/geometric_texture.h"
#include "tests/bench/wall.h"

namespace {

using Imath::V3d;
using mapping::GridBlock;
using wall::kAngle;
using wall::kHeight;
using wall::kInner;
using wall::kLength;
using wall::kTextureVoxels;
using wall::kTolerance;
using wall::now;

constexpr int kPlaces = 2000;  // positions where the error is measured
// Particles × points up to which a direct sum runs completely, and the size of the sample above
// that.
constexpr double kWhole = 1.1e11, kSampled = 1e10;

/// Exact u, v, w of a position, to rounding. The waves are so small that the fixed-point iteration
/// converges.
V3d fromWall(const V3d& x) {
  const double w = (std::hypot(x.x, x.z) - kInner) / kHeight;
  V3d uvw(std::atan2(x.x, x.z) / kAngle + 0.5, x.y / kLength, w);
  for (int n = 0; n < 60; ++n) {
    uvw.x = (std::atan2(x.x, x.z) - 0.02 * std::sin(7 * uvw.y)) / kAngle + 0.5;
    uvw.y = (x.y - 0.05 * std::sin(9 * uvw.x)) / kLength;
  }
  return uvw;
}

/// Places particles at the same spacing across the wall and along it.
mapping::Patch makePatch(double particles) {
  const double spacing = std::cbrt(kLength * kLength * kHeight / particles);
  return wall::makePatch(particles, std::max(4.0, std::round(kHeight / spacing) + 1));
}

mapping::RbfMap solve(const mapping::Patch& patch, mapping::RbfKernel kernel) {
  mapping::RbfMapOptions options;
  options.kernel = kernel;
  options.lambdaNear = options.lambdaFar = 0;
  options.solveTolerance = 0.1 * kTolerance / kTextureVoxels;
  return mapping::patchToTexture(patch, options);
}

/// Evaluates all leaf blocks of the wall, or a random share of them.
struct Run {
  double points = 0, seconds = 0;
  double share = 1;    ///< share of the blocks, chosen at random
  double timed = 0;    ///< number of timed points
  double fastOff = 0;  ///< largest difference of the fast sum at these points, texture voxels
  std::mt19937_64 random{7};

  void descend(const GridBlock& block, const mapping::BlockMap& map) {
    const Imath::Box3d image = map.imageBounds();
    if (image.isEmpty() || !image.intersects({V3d(0), V3d(1)})) return;
    if (block.edge > GridBlock::kLeafEdge) {
      for (int bits = 0; bits < 8; ++bits) descend(block.octant(bits), *map.octant(bits));
      return;
    }
    if (!wall::holds(block)) return;
    std::array<V3d, 512> uvw;
    (void)map.evaluate(uvw);
    points += 512;
  }

  /// Times only the direct sum, which gains nothing from the descent. The fast sum gives the
  /// difference between the two.
  void direct(const GridBlock& block, const mapping::PatchMap& map, const mapping::BlockMap& fast) {
    if (block.edge > GridBlock::kLeafEdge) {
      for (int bits = 0; bits < 8; ++bits) direct(block.octant(bits), map, *fast.octant(bits));
      return;
    }
    if (!wall::holds(block)) return;
    points += 512;
    if (std::uniform_real_distribution<double>(0, 1)(random) >= share) return;
    timed += 512;
    std::array<V3d, 512> uvw, fastUvw;
    const double start = now();
    (void)map.restrictTo(block, 0)->evaluate(uvw);
    seconds += now() - start;
    (void)fast.evaluate(fastUvw);
    for (std::size_t n = 0; n < uvw.size(); ++n) {
      const double off = (fastUvw[n] - uvw[n]).length() * kTextureVoxels;
      fastOff = std::max(fastOff, std::isnan(off) ? HUGE_VAL : off);
    }
  }
};

struct Error {
  double percent99 = 0, largest = 0;  ///< texture voxels
};

/// @param at  value of the map at a position
template <typename At>
Error errorOf(const At& at) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> inside(0.1, 0.9);
  std::vector<double> errors;
  for (int n = 0; n < kPlaces; ++n) {
    const double u = inside(random), v = inside(random), w = inside(random);
    const V3d x = wall::place({u, v, w});
    errors.push_back((at(x) - fromWall(x)).length() * kTextureVoxels);
  }
  std::sort(errors.begin(), errors.end());
  return {errors[errors.size() * 99 / 100], errors.back()};
}

/// Evaluates the fast sum in a block of a single spot around a position.
V3d fastAt(const mapping::RbfMap& map, const V3d& x, double step) {
  Imath::M33d rows;
  for (int i = 0; i < 3; ++i) rows[i][i] = step;
  std::array<V3d, 512> uvw;
  (void)map.restrictTo({x, rows, GridBlock::kLeafEdge}, kTolerance / kTextureVoxels)->evaluate(uvw);
  return uvw[0];
}

void tell(const char* map, std::size_t particles, double points, double setup, double seconds,
          const Error& error, bool isSampled) {
  fmt::print("map_error,{},levelsmith,1e{:.0f}x1e{:.0f},{},{:.0f},{:.4g},{:.4g},{:.4g},{:.4g},{}\n",
             map, std::log10(static_cast<double>(particles)), std::log10(points), particles, points,
             setup, seconds, error.percent99, error.largest, isSampled ? 1 : 0);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const double most = argc > 1 ? std::atof(argv[1]) : 1e8;
  std::vector<double> sizes = {1e3, 1e4, 1e5};
  if (argc > 2) sizes = {std::atof(argv[2])};
  const std::string variants = argc > 3 ? argv[3] : "shell,fast,compact,direct";
  const auto measures = [&](const char* variant) {
    return ("," + variants + ",").find(fmt::format(",{},", variant)) != std::string::npos;
  };
  const bool sums = measures("fast") || measures("direct");
  double fastOff = 0;
  fmt::print(
      "case,variant,tool,resolution,particles,points,setup_s,mapping_s,error_99,error_max,"
      "sampled\n");
  for (const double size : sizes) {
    const mapping::Patch patch = makePatch(size);
    std::optional<mapping::RbfMap> rbf, compact;
    double start = now();
    if (sums) rbf = solve(patch, mapping::RbfKernel::Biharmonic);
    const double solved = now() - start;
    start = now();
    if (measures("compact")) compact = solve(patch, mapping::RbfKernel::Wendland);
    const double factored = now() - start;
    const std::size_t particles = rbf       ? rbf->size()
                                  : compact ? compact->size()
                                            : patch.particleCount();
    const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
    start = now();
    const mapping::PrismMap shell(patch, {.embedDepth = 0.05, .rim = 0.05});
    const double built = now() - start;
    const auto errorOfSum = [](const mapping::RbfMap& map) {
      return errorOf([&](const V3d& x) { return fastAt(map, x, 0.005); });
    };
    const Error direct = rbf ? errorOf([&](const V3d& x) { return (*rbf)(x); }) : Error{};
    const Error fast = rbf ? errorOfSum(*rbf) : Error{};
    const Error local = compact ? errorOfSum(*compact) : Error{};
    const Error straight = errorOf([&](const V3d& x) { return shell(x); });
    for (double points = 1e6; points <= most * 1.01; points *= 10) {
      const std::vector<GridBlock> roots = wall::rootsOf(points);
      Run hybrid, sum, near, all;
      if (measures("shell")) {
        start = now();
        for (const GridBlock& root : roots) hybrid.descend(root, *shell.restrictTo(root, 0));
        tell("shell", particles, hybrid.points, built, now() - start, straight, false);
      }
      if (measures("fast")) {
        start = now();
        for (const GridBlock& root : roots)
          sum.descend(root, *rbf->restrictTo(root, kTolerance / kTextureVoxels));
        tell("fast", particles, sum.points, solved, now() - start, fast, false);
      }
      if (measures("compact")) {
        start = now();
        for (const GridBlock& root : roots)
          near.descend(root, *compact->restrictTo(root, kTolerance / kTextureVoxels));
        tell("compact", particles, near.points, factored, now() - start, local, false);
      }
      if (measures("direct")) {
        const double pairs = static_cast<double>(particles) * points;
        all.share = pairs > kWhole ? kSampled / pairs : 1;
        for (const GridBlock& root : roots)
          all.direct(root, *rbf, *rbf->restrictTo(root, kTolerance / kTextureVoxels));
        fastOff = std::max(fastOff, all.fastOff);
        tell("direct", particles, all.points, solved, all.seconds * all.points / all.timed, direct,
             all.share < 1);
      }
    }
  }
  if (measures("direct"))
    fmt::print(stderr, "The fast sum is off the direct one by {:.4f} texture voxel ({} allowed).\n",
               fastOff, kTolerance);
  return fastOff <= kTolerance ? 0 : 1;
}
