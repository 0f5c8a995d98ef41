// Measures the time per grid point, or per vertex, of each map beside the direct sum of the RBF
// map. Uses one thread, and a third of a cylinder's wall with a texture of 256 x 256 x 64 voxels.
// Solving is timed separately. The direct sum runs on a hundredth of the blocks. A random choice
// (seed 7) keeps grid patterns out of the sample, and each run has the same sample.
//
//   mapping_bench [PARTICLES = 10000] [POINTS = 10000000] [SOLVED = 100000]
//
// Then times the seven kernels on a tenth of the points with 2000 particles. Last, times the
// iterative solution for SOLVED particles on all threads (0: skipped).
//
// Exits 1 when the fast sum is less than 30 times as fast as the direct one, or off by more than
// 0.05 texture voxel. Exits 1 when tetrahedra are less than 5 times as fast. Exits 1 when a mesh
// maps less than 5 million vertices a second, with or without normals and texture coordinates.

#include <fmt/core.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "mapping/maps/layer_map.h"
#include "mapping/maps/prism_map.h"
#include "mapping/placement/make_patch.h"
#include "mapping/textures/geometric_texture.h"
#include "mapping/textures/mesh_texture.h"
#include "tests/bench/wall.h"

namespace {

using Imath::V3d;
using mapping::GridBlock;
using mapping::patchToTexture;
using wall::kTextureVoxels;
using wall::kTolerance;
using wall::now;

constexpr unsigned kDirectShare = 100, kSeed = 7;
constexpr double kLayers = 6;

struct Cost {
  double points = 0, seconds = 0, directPoints = 0, directSeconds = 0, operations = 0, worst = 0;
};

/// Descends into the blocks that touch the unit cube, as a texture warp does, and evaluates the
/// wall.
template <typename Direct>
void descend(const GridBlock& block, const mapping::BlockMap& map, Cost& cost,
             const Direct& direct) {
  const Imath::Box3d image = map.imageBounds();
  if (image.isEmpty() || !image.intersects({V3d(0), V3d(1)})) return;
  if (block.edge > GridBlock::kLeafEdge) {
    for (int bits = 0; bits < 8; ++bits)
      descend(block.octant(bits), *map.octant(bits), cost, direct);
    return;
  }
  if (!wall::holds(block)) return;
  std::array<V3d, 512> uvw;
  cost.operations += static_cast<double>(map.evaluate(uvw));
  cost.points += 512;
  direct(block, uvw);
}

template <typename Direct>
Cost run(const mapping::PatchMap& map, std::span<const GridBlock> grid, double tolerance,
         const Direct& direct) {
  Cost cost;
  const double start = now();
  for (const GridBlock& block : grid) {
    descend(block, *map.restrictTo(block, tolerance), cost,
            [&](const GridBlock& at, const std::array<V3d, 512>& uvw) { direct(at, uvw, cost); });
  }
  cost.seconds = now() - start - cost.directSeconds;
  return cost;
}

void report(const char* name, const Cost& cost) {
  fmt::print("{:<11} {:>10.3g} points {:>9.1f} ns a point {:>8.2f} operations a point\n", name,
             cost.points, 1e9 * cost.seconds / cost.points, cost.operations / cost.points);
}

void compareKernels(double points) {
  constexpr std::array kNames = {"biharmonic", "triharmonic", "thin-plate", "sum",
                                 "laplacian",  "gaussian",    "wendland"};
  const mapping::Patch patch = wall::makePatch(2000, kLayers);
  const std::vector<GridBlock> grid = wall::rootsOf(points);
  for (std::size_t n = 0; n < kNames.size(); ++n) {
    const mapping::RbfMap map =
        patchToTexture(patch, {.kernel = static_cast<mapping::RbfKernel>(n)});
    report(kNames[n], run(map, grid, kTolerance / kTextureVoxels,
                          [](const GridBlock&, const std::array<V3d, 512>&, Cost&) {}));
  }
}

void solveMany(std::size_t particles) {
  const mapping::Patch patch = wall::makePatch(static_cast<double>(particles), kLayers);
  const double start = now();
  const auto wallStart = std::chrono::steady_clock::now();
  const mapping::RbfMap map = patchToTexture(patch, {.denseLimit = 0});
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - wallStart;
  const mapping::RbfSolveReport& report = map.solveReport();
  fmt::print(
      "{} particles solved by {} iterations in {:.1f} s ({:.1f} CPU s), residual {:.2g} of u, v, "
      "w\n",
      map.size(), report.iterations, wall.count(), now() - start, report.solveResidual);
}

}  // namespace

int main(int argc, char** argv) {
  std::optional<tbb::global_control> oneThread;
  oneThread.emplace(tbb::global_control::max_allowed_parallelism, 1);
  const auto particles = static_cast<std::size_t>(argc > 1 ? std::atol(argv[1]) : 10000);
  const double points = argc > 2 ? std::atof(argv[2]) : 1e7;
  const mapping::Patch patch = wall::makePatch(static_cast<double>(particles), kLayers);
  const std::vector<GridBlock> grid = wall::rootsOf(points);

  double start = now();
  const mapping::RbfMap rbf = patchToTexture(patch, {.denseLimit = particles + 1000});
  fmt::print("{} particles, solved in {:.1f} s\n", rbf.size(), now() - start);

  // Direct sum: every particle at every grid point, with the same vector code.
  std::mt19937 random(kSeed);
  const Cost fast = run(rbf, grid, kTolerance / kTextureVoxels,
                        [&](const GridBlock& block, const std::array<V3d, 512>& uvw, Cost& cost) {
                          if (random() % kDirectShare != 0) return;
                          const double from = now();
                          std::array<V3d, 512> exact;
                          (void)rbf.restrictTo(block, 0)->evaluate(exact);
                          cost.directSeconds += now() - from;
                          cost.directPoints += 512;
                          for (std::size_t n = 0; n < 512; ++n) {
                            const double off = (uvw[n] - exact[n]).length() * kTextureVoxels;
                            cost.worst = std::max(cost.worst, std::isnan(off) ? HUGE_VAL : off);
                          }
                        });
  const double direct = fast.directSeconds / fast.directPoints;
  fmt::print(
      "direct      {:>10.3g} points {:>9.1f} ns a point (blocks drawn at random with seed {}: "
      "{:.0f} of {:.0f} points)\n",
      fast.directPoints, 1e9 * direct, kSeed, fast.directPoints, fast.points);
  report("fast", fast);
  const double ratio = direct / (fast.seconds / fast.points);
  fmt::print("         {:.1f} times as fast (30 wanted), off by {:.4f} texture voxel at the most\n",
             ratio, fast.worst);

  start = now();
  const mapping::PrismMap shell(patch, {.embedDepth = 0.05, .rim = 0.05});
  fmt::print("shell map made in {:.2f} s\n", now() - start);
  const Cost tetrahedra =
      run(shell, grid, 0, [](const GridBlock&, const std::array<V3d, 512>&, Cost&) {});
  report("shell", tetrahedra);
  const double shellRatio = direct / (tetrahedra.seconds / tetrahedra.points);
  fmt::print("         {:.1f} times as fast as the direct sum (5 wanted)\n", shellRatio);

  constexpr int kVertices = 5'000'000;
  start = now();
  V3d sum(0);
  for (int i = 0; i < kVertices; ++i) {
    const double t = static_cast<double>(i) / kVertices;
    sum += mapping::layerPosition(patch, {t, std::fmod(37 * t, 1), std::fmod(1009 * t, 1)});
  }
  fmt::print("vertices {:.3g} million a second (5 wanted){}\n", kVertices / (now() - start) / 1e6,
             sum.x == 0.5 ? " " : "");

  // The complete work of `texture --map mesh`, without and with vertex attributes.
  levelset::TriMesh cloud;
  for (int i = 0; i < kVertices; ++i) {
    const double t = static_cast<double>(i) / kVertices;
    cloud.positions.emplace_back(t, std::fmod(37 * t, 1), std::fmod(1009 * t, 1));
  }
  cloud.triangles.push_back({0, 1, 2});
  bool fastEnough = true;
  for (const bool carries : {false, true}) {
    if (carries) {
      cloud.attributes.normals.assign(cloud.positions.size(), V3d(0.6, 0, 0.8));
      cloud.attributes.uvs.assign(cloud.positions.size(), Imath::V2d(0.5));
    }
    start = now();
    const mapping::MeshTextureResult moved = mapping::mapMesh(
        cloud, patch, {.textureBox = Imath::Box3d(V3d(0), V3d(1)), .allowFolds = true});
    const double rate = static_cast<double>(moved.mesh.positions.size()) / (now() - start) / 1e6;
    fmt::print("meshes   {:.3g} million vertices a second {} (5 wanted)\n", rate,
               carries ? "with normals and texture coordinates" : "without attributes");
    fastEnough = fastEnough && rate >= 5;
  }

  compareKernels(points / 10);
  oneThread.reset();
  const auto solved = static_cast<std::size_t>(argc > 3 ? std::atol(argv[3]) : 100000);
  if (solved > 0) solveMany(solved);
  return ratio >= 30 && fast.worst <= kTolerance && shellRatio >= 5 && fastEnough ? 0 : 1;
}
