#include "levelset/inspect/symmetric_difference.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatTree;
using openvdb::Vec3d;

struct TetCorner {
  Vec3d p;
  std::array<double, 2> phi;  ///< values of the two fields A and B
};
using Tet = std::array<TetCorner, 4>;

/// The parts of a tetrahedron in which one linear field is negative: at most three tetrahedra.
struct NegativeParts {
  std::array<Tet, 3> tets;
  std::size_t count = 0;

  NegativeParts(const Tet& tet, std::size_t field) {
    std::array<const TetCorner*, 4> sorted;
    std::size_t negative = 0, positive = 4;
    for (const TetCorner& c : tet) sorted[c.phi[field] < 0 ? negative++ : --positive] = &c;
    const auto cut = [&](std::size_t n, std::size_t p) {
      return between(*sorted[n], *sorted[p], field);
    };
    if (negative == 4) {
      tets[count++] = tet;
    } else if (negative == 3) {
      addPrism({*sorted[0], *sorted[1], *sorted[2]}, {cut(0, 3), cut(1, 3), cut(2, 3)});
    } else if (negative == 2) {
      addPrism({*sorted[0], cut(0, 2), cut(0, 3)}, {*sorted[1], cut(1, 2), cut(1, 3)});
    } else if (negative == 1) {
      tets[count++] = {*sorted[0], cut(0, 1), cut(0, 2), cut(0, 3)};
    }
  }

 private:
  static TetCorner between(const TetCorner& n, const TetCorner& p, std::size_t field) {
    const double t = n.phi[field] / (n.phi[field] - p.phi[field]);
    TetCorner result{n.p + (p.p - n.p) * t, {}};
    for (std::size_t i = 0; i < 2; ++i) result.phi[i] = n.phi[i] + (p.phi[i] - n.phi[i]) * t;
    result.phi[field] = 0;
    return result;
  }
  void addPrism(const std::array<TetCorner, 3>& p, const std::array<TetCorner, 3>& q) {
    tets[count++] = {p[0], p[1], p[2], q[2]};
    tets[count++] = {p[0], p[1], q[1], q[2]};
    tets[count++] = {p[0], q[0], q[1], q[2]};
  }
};

double tetVolume(const Tet& t) {
  return std::abs((t[1].p - t[0].p).dot((t[2].p - t[0].p).cross(t[3].p - t[0].p))) / 6;
}

double negativeVolume(const Tet& tet, std::size_t field) {
  const NegativeParts parts(tet, field);
  double sum = 0;
  for (std::size_t i = 0; i < parts.count; ++i) sum += tetVolume(parts.tets[i]);
  return sum;
}

/// Returns the volume of the symmetric difference of two fields in a unit cell, split into six
/// tetrahedra around its diagonal. Corners have the numbers dx·4 + dy·2 + dz.
double cellDifference(const std::array<std::array<double, 2>, 8>& corners) {
  constexpr std::array<std::array<int, 2>, 6> kPaths = {
      {{4, 6}, {4, 5}, {2, 6}, {2, 3}, {1, 5}, {1, 3}}};
  const auto corner = [&](int i) {
    return TetCorner{Vec3d(i >> 2, (i >> 1) & 1, i & 1), corners[static_cast<std::size_t>(i)]};
  };
  double sum = 0;
  for (const auto& path : kPaths) {
    const Tet tet = {corner(0), corner(path[0]), corner(path[1]), corner(7)};
    double both = 0;
    const NegativeParts inA(tet, 0);
    for (std::size_t i = 0; i < inA.count; ++i) both += negativeVolume(inA.tets[i], 1);
    sum += std::max(0.0, negativeVolume(tet, 0) + negativeVolume(tet, 1) - 2 * both);
  }
  return sum;
}

/// Returns the volume of the symmetric difference, in voxels, in the cells whose lowest corners lie
/// in the leaf block at `origin`.
double blockDifference(const FloatTree& a, const FloatTree& b, const Coord& origin) {
  std::vector<std::array<double, 2>> values;
  values.reserve(729);
  const openvdb::tree::ValueAccessor<const FloatTree> readA(a), readB(b);
  for (int x = 0; x < 9; ++x)
    for (int y = 0; y < 9; ++y)
      for (int z = 0; z < 9; ++z) {
        const Coord c = origin.offsetBy(x, y, z);
        values.push_back(
            {static_cast<double>(readA.getValue(c)), static_cast<double>(readB.getValue(c))});
      }
  double sum = 0;
  std::array<std::array<double, 2>, 8> corners;
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z) {
        std::array<int, 2> inside = {};
        for (int i = 0; i < 8; ++i) {
          const int at = ((x + (i >> 2)) * 9 + y + ((i >> 1) & 1)) * 9 + z + (i & 1);
          corners[static_cast<std::size_t>(i)] = values[static_cast<std::size_t>(at)];
          for (std::size_t k = 0; k < 2; ++k)
            inside[k] += corners[static_cast<std::size_t>(i)][k] < 0;
        }
        if (inside[0] % 8 == 0 && inside[1] % 8 == 0)
          sum += inside[0] != inside[1];
        else
          sum += cellDifference(corners);
      }
  return sum;
}

/// Returns the origins of the leaf blocks of both trees, and of the blocks before them on each
/// axis, whose last cells extend into a leaf block.
std::vector<Coord> blocksOfBoth(const FloatTree& a, const FloatTree& b) {
  std::vector<Coord> blocks;
  for (const FloatTree* tree : {&a, &b})
    for (auto leaf = tree->cbeginLeaf(); leaf; ++leaf)
      for (int side = 0; side < 8; ++side)
        blocks.push_back(
            leaf->origin().offsetBy(side & 4 ? -8 : 0, side & 2 ? -8 : 0, side & 1 ? -8 : 0));
  std::sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  return blocks;
}

openvdb::MaskTree insideTiles(const FloatTree& tree) {
  openvdb::MaskTree mask;
  for (auto tile = tree.cbeginValueAll(); tile; ++tile) {
    tile.setMaxDepth(FloatTree::DEPTH - 2);
    if (tile.getDepth() < FloatTree::DEPTH - 1 && *tile < 0)
      mask.addTile(tile.getLevel(), tile.getCoord(), true, true);
  }
  return mask;
}

/// Returns the number of voxels in tiles that are inside in one tree only. Leaves out the voxels of
/// `blocks`.
double tileDifference(const FloatTree& a, const FloatTree& b, const std::vector<Coord>& blocks) {
  const openvdb::MaskTree inA = insideTiles(a), inB = insideTiles(b);
  double sum = 0;
  for (const auto& [mine, other] : {std::pair(&inA, &inB), std::pair(&inB, &inA)}) {
    openvdb::MaskTree alone(*mine);
    alone.topologyDifference(*other);
    for (const Coord& origin : blocks)
      alone.fill(openvdb::CoordBBox::createCube(origin, 8), false, false);
    sum += static_cast<double>(alone.activeVoxelCount());
  }
  return sum;
}

}  // namespace

double symmetricDifference(const FloatTree& a, const FloatTree& b) {
  const std::vector<Coord> blocks = blocksOfBoth(a, b);
  std::vector<double> parts(blocks.size());
  tbb::parallel_for(std::size_t{0}, blocks.size(),
                    [&](std::size_t i) { parts[i] = blockDifference(a, b, blocks[i]); });
  double sum = tileDifference(a, b, blocks);
  for (const double part : parts) sum += part;
  return sum;
}

}  // namespace levelset
