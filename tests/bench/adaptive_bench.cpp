// Adaptive distance fields beside narrow bands: error against memory and time.
//
//   adaptive_bench fields SHAPE…   SHAPE: sphere, detail (a box with a part of a thousandth of its
//                                  size), or a mesh file
//   adaptive_bench tolerance SHAPE…  largest error at a million random points, on both sides, in
//                                  tolerances
//   adaptive_bench octree          random access to cells by their keys: a hashed octree beside a
//                                  linked one [Sigg06, table 3.1]
//
// `fields` prints a line of CSV for each structure and setting: bytes, CPU seconds of the
// conversion, largest and mean error. Both structures hold distances up to 1 % of the diagonal of
// the bounding box. Errors are measured at random points within 0.8 % of the surface and given in
// thousandths of the diagonal, like the tolerances. The settings are tolerances and voxel sizes.

#include <fmt/core.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "levelset/adaptive/mesh_distance.h"
#include "levelset/adaptive/mesh_to_adaptive.h"
#include "levelset/adaptive/octree/hashed_octree.h"
#include "levelset/convert/mesh_to_band.h"
#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/mesh_files/mesh_file.h"
#include "tests/support/meshes.h"

namespace {

using namespace levelset;
using Imath::V3d;
using Imath::V3i;

double cpuSeconds() {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(use.ru_utime) + seconds(use.ru_stime);
}

TriMesh shapeOf(const std::string& name) {
  if (name == "sphere") return support::sphereMesh(1, V3d(0), 256);
  if (name == "detail")
    return support::joined(support::boxMesh(V3d(0), V3d(1)),
                           support::boxMesh(V3d(1.001, 0.371, 0.713), V3d(1.002, 0.372, 0.714)));
  return readMesh(name);
}

/// Points near a surface with their exact distances.
struct Probe {
  V3d position;
  double distance;
};

std::vector<Probe> probesOf(const TriMesh& mesh, const SignedDistance& distance, double reach,
                            std::size_t count) {
  std::vector<double> areas;
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const V3d &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    areas.push_back(sum += (b - a).cross(c - a).length());
  }
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Probe> probes;
  while (probes.size() < count) {
    const auto found = std::lower_bound(areas.begin(), areas.end(), unit(random) * sum);
    // Every fourth point near a random triangle, whatever its size, so that small parts count.
    const std::size_t n = probes.size() % 4 == 0
                              ? random() % areas.size()
                              : std::min<std::size_t>(found - areas.begin(), areas.size() - 1);
    const auto& t = mesh.triangles[n];
    const V3d &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    const double u = std::sqrt(unit(random)), v = unit(random);
    const V3d normal = (b - a).cross(c - a);
    if (normal.length2() == 0) continue;
    const V3d p = a * (1 - u) + b * (u * (1 - v)) + c * (u * v) +
                  normal.normalized() * ((2 * unit(random) - 1) * reach);
    probes.push_back({p, distance.at(p, {})});
  }
  return probes;
}

void row(const std::string& shape, const char* structure, double setting, std::size_t bytes,
         double seconds, const std::vector<Probe>& probes, double unit,
         const std::function<double(const V3d&)>& value) {
  double largest = 0, sum = 0;
  for (const Probe& probe : probes) {
    const double error = std::abs(value(probe.position) - probe.distance);
    largest = std::max(largest, error);
    sum += error;
  }
  fmt::print("{},{},{:.4g},{},{:.2f},{:.4g},{:.4g}\n", shape, structure, setting, bytes, seconds,
             largest / unit, sum / double(probes.size()) / unit);
  std::fflush(stdout);
}

void compareFields(const std::string& shape) {
  const TriMesh mesh = shapeOf(shape);
  const Imath::Box3d box = bounds(mesh);
  const double diagonal = (box.max - box.min).length(), unit = diagonal / 1000,
               halfWidth = diagonal / 100;
  const MeshDistance distance(mesh, unit, {.acceptSign = true});
  const std::vector<Probe> probes = probesOf(mesh, distance, 0.8 * halfWidth, 100000);
  std::string name = shape.substr(shape.find_last_of('/') + 1);
  name = name.substr(0, name.find('.'));
  for (const bool isTricubic : {false, true})
    for (const double tolerance : {3.0, 1.0, 0.3}) {
      const double start = cpuSeconds();
      const AdaptiveField field = meshToAdaptive(mesh, {.tolerance = tolerance * unit,
                                                        .halfWidth = halfWidth,
                                                        .isTricubic = isTricubic,
                                                        .acceptSign = true})
                                      .field;
      const double seconds = cpuSeconds() - start;
      const AdaptiveSampler sampler(field);
      row(name, isTricubic ? "adaptive-tricubic" : "adaptive", tolerance, field.memoryUse(),
          seconds, probes, unit, [&](const V3d& p) { return sampler.value(p); });
    }
  for (const double voxel : {8.0, 4.0, 2.0, 1.0}) {
    const double start = cpuSeconds();
    NarrowBand band;
    try {
      band = meshToBand(
                 mesh, voxel * unit,
                 {.halfWidth = std::max(halfWidth / (voxel * unit), 1.0) + 1, .acceptSign = true})
                 .band;
    } catch (const Error& error) {
      fmt::print(stderr, "{}: {}\n", name, error.what());
      continue;
    }
    const double seconds = cpuSeconds() - start;
    for (const auto interpolation : {Interpolation::Trilinear, Interpolation::Tricubic}) {
      const BandSampler sampler(band, interpolation);
      row(name, interpolation == Interpolation::Trilinear ? "band" : "band-tricubic", voxel,
          band.memoryUse(), seconds, probes, unit, [&](const V3d& p) { return sampler.value(p); });
    }
  }
}

/// Largest error of fields at random points within their half width, on each side.
void testTolerance(const std::string& shape) {
  const TriMesh mesh = shapeOf(shape);
  const Imath::Box3d box = bounds(mesh);
  const double unit = (box.max - box.min).length() / 1000, halfWidth = 10 * unit;
  const MeshDistance distance(mesh, unit, {.acceptSign = true});
  const std::vector<Probe> probes = probesOf(mesh, distance, halfWidth, 1000000);
  for (const auto& [isTricubic, tolerance] :
       {std::pair(false, 3.0), std::pair(false, 1.0), std::pair(false, 0.3), std::pair(true, 3.0),
        std::pair(true, 1.0), std::pair(true, 0.3)}) {
    const AdaptiveField field = meshToAdaptive(mesh, {.tolerance = tolerance * unit,
                                                      .halfWidth = halfWidth,
                                                      .isTricubic = isTricubic,
                                                      .acceptSign = true})
                                    .field;
    const AdaptiveSampler sampler(field);
    std::array<double, 2> largest{};
    std::array<std::size_t, 2> counts{};
    for (const Probe& probe : probes) {
      const std::size_t side = probe.distance < 0 ? 0 : 1;
      ++counts[side];
      largest[side] =
          std::max(largest[side],
                   std::abs(sampler.value(probe.position) - probe.distance) / field.tolerance());
    }
    fmt::print("{}: {}, tolerance {:.4g}: {:.3f} inside ({} points), {:.3f} outside ({} points)\n",
               shape, isTricubic ? "tricubic" : "trilinear", tolerance, largest[0], counts[0],
               largest[1], counts[1]);
    std::fflush(stdout);
  }
}

/// Octree with pointers: eight children and the parent, as 32-bit numbers.
class LinkedOctree {
 public:
  explicit LinkedOctree(int depth) : depth_(depth) { cells_.push_back({}); }
  void split(const CellKey& leaf) {
    const std::uint32_t cell = find(leaf);
    for (std::size_t k = 0; k < 8; ++k) {
      cells_[cell].children[k] = static_cast<std::uint32_t>(cells_.size());
      cells_.push_back({cell, {}});
    }
  }
  /// Number of a cell that the tree has.
  [[nodiscard]] std::uint32_t find(const CellKey& key) const {
    std::uint32_t cell = 0;
    for (int level = depth_ - 1; level >= key.level; --level)
      cell = cells_[cell].children[octantAt(key, level)];
    return cell;
  }
  /// Level of the smallest cell that holds a finest cell.
  [[nodiscard]] int leafLevel(const CellKey& finest) const {
    std::uint32_t cell = 0;
    for (int level = depth_ - 1;; --level) {
      const std::uint32_t child = cells_[cell].children[octantAt(finest, std::max(level, 0))];
      if (child == 0 || level < 0) return level + 1;
      cell = child;
    }
  }
  [[nodiscard]] std::size_t memoryUse() const { return cells_.size() * sizeof(Cell); }

 private:
  static std::size_t octantAt(const CellKey& key, int level) {
    return (key.x >> level & 1) | (key.y >> level & 1) << 1 | (key.z >> level & 1) << 2;
  }
  struct Cell {
    std::uint32_t parent = 0;
    std::array<std::uint32_t, 8> children{};
  };
  int depth_;
  std::vector<Cell> cells_;
};

void compareOctrees() {
  fmt::print(
      "levels,cells,linked_ns,hashed_ns,published_ratio,ratio,linked_bytes,hashed_bytes,"
      "leaf_linked_ns,leaf_hashed_ns\n");
  const std::array<std::pair<int, double>, 4> published = {
      {{5, 0.994}, {7, 1.029}, {9, 0.739}, {10, 0.586}}};
  for (const auto& [depth, ratio] : published) {
    // Cells that a sphere crosses are refined to the last level.
    HashedOctree hashed(depth);
    LinkedOctree linked(depth);
    const double centre = std::ldexp(0.5, depth), radius = 0.4 * std::ldexp(1, depth);
    std::vector<CellKey> cells{hashed.root()};
    for (std::size_t n = 0; n < cells.size(); ++n) {
      const CellKey cell = cells[n];
      const V3d middle = V3d(cell.low()) + V3d(0.5 * cell.edge());
      const double distance = std::abs((middle - V3d(centre)).length() - radius);
      if (cell.level == 0 || distance > 0.5 * std::sqrt(3.0) * cell.edge()) continue;
      hashed.split(cell);
      linked.split(cell);
      for (int octant = 0; octant < 8; ++octant) cells.push_back(cell.child(octant));
    }
    std::mt19937_64 random(3);
    constexpr std::size_t kQueries = 5000000;
    std::vector<CellKey> keys(kQueries);
    for (CellKey& key : keys) key = cells[1 + random() % (cells.size() - 1)];
    const auto nanoseconds = [&](const auto& visit) {
      double least = INFINITY;
      for (int run = 0; run < 3; ++run) {
        const auto start = std::chrono::steady_clock::now();
        std::uint64_t sum = 0;
        for (const CellKey& key : keys) sum += visit(key);
        volatile std::uint64_t sink = sum;
        (void)sink;
        const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
        least = std::min(least, 1e9 * time.count() / double(kQueries));
      }
      return least;
    };
    const double byLinks = nanoseconds([&](const CellKey&key) { return linked.find(key); }),
                 byHash = nanoseconds([&](const CellKey&key) {
                   return 8 * hashed.block(key.parent()) + unsigned(key.octant());
                 });
    const double leafByLinks =
                     nanoseconds([&](const CellKey&key) { return linked.leafLevel(key); }),
                 leafByHash =
                     nanoseconds([&](const CellKey&key) { return hashed.leafAt(key.low()).level; });
    fmt::print("{},{},{:.0f},{:.0f},{:.2f},{:.2f},{:.1f},{:.1f},{:.0f},{:.0f}\n", depth,
               hashed.cellCount(), byLinks, byHash, ratio, byHash / byLinks,
               double(linked.memoryUse()) / double(hashed.cellCount()),
               double(hashed.memoryUse()) / double(hashed.cellCount()), leafByLinks, leafByHash);
  }
}

}  // namespace

int main(int argc, char** argv) try {
  const std::string what = argc > 1 ? argv[1] : "";
  if (what == "octree") {
    compareOctrees();
    return 0;
  }
  if ((what != "fields" && what != "tolerance") || argc < 3) {
    fmt::print(stderr, "adaptive_bench fields|tolerance SHAPE… | adaptive_bench octree\n");
    return 2;
  }
  if (what == "tolerance") {
    for (int k = 2; k < argc; ++k) testTolerance(argv[k]);
    return 0;
  }
  fmt::print("shape,structure,setting,bytes,seconds,largest_error,mean_error\n");
  for (int k = 2; k < argc; ++k) compareFields(argv[k]);
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "adaptive_bench: {}\n", error.what());
  return 1;
}
