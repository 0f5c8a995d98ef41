// Compares offset with a search, beside the creases in which parts of the moved surface meet.
//
//   offset_crease_bench FILE.vdb VOXELS [COUNT]
//
// Chooses COUNT (default 100) grid points on the near side of the moved surface at which its
// distance differs from the distance to the old surface minus VOXELS by more than 0.02 voxel. The
// truth is the shortest of the ways out to the moved surface in 600 directions, refined around the
// best ones. Prints the errors of offset and of OpenVDB's LevelSetFilter, voxels.

#include <fmt/core.h>
#include <openvdb/tools/LevelSetFilter.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>
#include <unordered_map>
#include <vector>

#include "levelset/distance/surface/closest_point.h"
#include "levelset/distance/surface/zero_set.h"
#include "levelset/files/band_file.h"
#include "levelset/offset/offset.h"
#include "levelset/vdb.h"

namespace {

using namespace levelset::eikonal;
using openvdb::Coord;
using openvdb::Vec3d;

constexpr int kCell = 2;          // edge of a cell of surface points, voxels
constexpr double kNearest = 0.7;  // surface points this much farther than the nearest count too
constexpr int kDirections = 600, kRefined = 6;

/// Signed distance to a zero set by brute force over the surface points, in index space.
class Distance {
 public:
  Distance(const openvdb::FloatGrid& grid, double largest)
      : surface_(readZeroSet(grid, {}, nullptr, {})),
        blocks_(*surface_.interpolated),
        reach_(static_cast<int>(std::ceil((largest + 4) / kCell))) {
    for (std::uint32_t i = 0; i < surface_.points.size(); ++i)
      cells_[Coord::floor(surface_.points.positions[i] / double{kCell})].push_back(i);
  }

  double operator()(const Vec3d& p) {
    double nearest = INFINITY;
    std::vector<std::pair<double, std::uint32_t>> near;
    const Coord own = Coord::floor(p / double{kCell});
    for (const Coord& c : openvdb::CoordBBox(own.offsetBy(-reach_), own.offsetBy(reach_))) {
      const Vec3d centre = (c.asVec3d() + Vec3d(0.5)) * double{kCell};
      if ((centre - p).length() - kCell > nearest + kNearest) continue;  // half diagonal < kCell
      const auto found = cells_.find(c);
      if (found == cells_.end()) continue;
      for (const std::uint32_t i : found->second) {
        const double distance = (surface_.points.positions[i] - p).length();
        nearest = std::min(nearest, distance);
        near.emplace_back(distance, i);
      }
    }
    double best = nearest;
    for (const auto& [distance, i] : near) {
      if (distance > nearest + kNearest) continue;
      const Vec3d start = surface_.points.positions[i];
      const DenseBlock& block = blocks_.around(start);
      const Vec3d origin = block.origin().asVec3d();
      const Foot foot = closestPoint(block, p - origin, start - origin);
      if (foot.converged && changesSignAround(block, foot.point))
        best = std::min(best, foot.distance);
    }
    const DenseBlock& block = blocks_.around(p);
    return std::copysign(best, block.jet(p - block.origin().asVec3d()).value);
  }

 private:
  ZeroSet surface_;
  DenseBlockCache blocks_;
  int reach_;
  std::unordered_map<Coord, std::vector<std::uint32_t>, std::hash<Coord>> cells_;
};

/// Distance from x to the moved surface along a direction; more than `limit` if it is farther.
double wayOut(Distance& distance, double shift, const Vec3d& x, const Vec3d& direction,
              double limit) {
  double t = 0;
  for (int step = 0; step < 60 && t < limit; ++step) {
    const double left = (shift - distance(x + direction * t)) * (shift > 0 ? 1 : -1);
    if (left < 1e-5) return t;
    t += left;  // no point of the moved surface is nearer
  }
  return std::max(t, limit);
}

double shortestWayOut(Distance& distance, double shift, const Vec3d& x) {
  std::vector<std::pair<double, Vec3d>> ways;
  double best = INFINITY;
  for (int k = 0; k < kDirections; ++k) {  // spiral on the sphere
    const double z = 1 - (2 * k + 1.0) / kDirections, around = std::sqrt(1 - z * z),
                 angle = k * std::numbers::pi * (3 - std::sqrt(5.0));
    const Vec3d u(around * std::cos(angle), around * std::sin(angle), z);
    ways.emplace_back(wayOut(distance, shift, x, u, best + 0.3), u);
    best = std::min(best, ways.back().first);
  }
  std::sort(ways.begin(), ways.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  for (int k = 0; k < kRefined; ++k) {
    auto [t, u] = ways[static_cast<std::size_t>(k)];
    for (double step = 0.1; step > 5e-4;) {
      Vec3d t1 = std::abs(u.x()) < 0.7 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
      t1 -= u * u.dot(t1);
      t1.normalize();
      const Vec3d t2 = u.cross(t1), before = u;
      for (int q = 0; q < 8; ++q) {
        const double angle = q * std::numbers::pi / 4;
        Vec3d v = before + (t1 * std::cos(angle) + t2 * std::sin(angle)) * step;
        v.normalize();
        const double found = wayOut(distance, shift, x, v, t);
        if (found < t - 1e-7) t = found, u = v;
      }
      if (u == before) step /= 2;
    }
    best = std::min(best, t);
  }
  return best;
}

void tell(const char* name, std::vector<double> errors) {
  std::sort(errors.begin(), errors.end());
  fmt::print("{:<26} median {:.2g}, 90 % {:.2g}, largest {:.2g}\n", name, errors[errors.size() / 2],
             errors[errors.size() * 9 / 10], errors.back());
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 3) {
    fmt::print(stderr, "offset_crease_bench FILE.vdb VOXELS [COUNT]\n");
    return 2;
  }
  const levelset::NarrowBand solid = levelset::readBand(argv[1]);
  const double shift = std::atof(argv[2]), voxel = solid.voxelSize();
  const std::size_t count = argc > 3 ? static_cast<std::size_t>(std::atoi(argv[3])) : 100;
  const levelset::NarrowBand moved = levelset::offset(solid, shift * voxel);
  const auto peer = levelset::vdb(solid).deepCopy();
  openvdb::tools::LevelSetFilter<openvdb::FloatGrid>(*peer).offset(
      static_cast<float>(-shift * voxel));

  Distance distance(levelset::vdb(solid), std::abs(shift) + 3);
  std::vector<Coord> near;
  for (auto it = levelset::vdb(moved).cbeginValueOn(); it; ++it)
    if ((*it < 0) == (shift > 0)) near.push_back(it.getCoord());
  std::shuffle(near.begin(), near.end(), std::mt19937(1));
  const auto ours = levelset::vdb(moved).getConstAccessor();
  const auto theirs = peer->getConstAccessor();
  std::vector<double> our, their;
  for (const Coord& c : near) {
    if (our.size() == count) break;
    const Vec3d x = c.asVec3d();
    const double value = std::abs(static_cast<double>(ours.getValue(c))) / voxel;
    if (std::abs(value - std::abs(distance(x) - shift)) < 0.02) continue;
    const double truth = shortestWayOut(distance, shift, x);
    our.push_back(std::abs(value - truth));
    their.push_back(std::abs(std::abs(static_cast<double>(theirs.getValue(c))) / voxel - truth));
  }
  if (our.empty()) {
    fmt::print("no grid point beside a crease\n");
    return 0;
  }
  fmt::print("{} grid points beside creases; errors in voxels:\n", our.size());
  tell("offset", our);
  tell("OpenVDB LevelSetFilter", their);
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "{}\n", error.what());
  return 1;
}
