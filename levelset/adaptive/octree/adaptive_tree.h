#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <vector>

#include "levelset/adaptive/octree/hashed_octree.h"

namespace levelset {

/// Values at the corners of the eight children of a cell: a lattice of 3³ points, x fastest.
using CornerValues = std::array<float, 27>;

/// Octree with the values of a block beside each block. A corner that several blocks share has the
/// same value in each.
struct AdaptiveTree {
  HashedOctree octree;
  std::vector<CornerValues> values;  ///< by number of block; the root has one
  Imath::V3d origin;                 ///< lowest corner of the root, world units
  double unit = 0;                   ///< edge of a cell of level 0, world units
  double tolerance = 0, halfWidth = 0;

  [[nodiscard]] Imath::V3d toWorld(const Imath::V3i& corner) const {
    return origin + Imath::V3d(corner * 2) * (unit / 2);  // the bits that buildAdaptive() reads
  }
  /// Value at a corner of a child.
  /// @param corner  bit 0 for the upper end along x, bit 1 along y, bit 2 along z
  [[nodiscard]] float corner(std::uint32_t block, int octant, int corner) const {
    return values[block][latticeIndex(octant, corner)];
  }
  [[nodiscard]] static std::size_t latticeIndex(int octant, int corner) {
    const int x = (octant & 1) + (corner & 1), y = (octant >> 1 & 1) + (corner >> 1 & 1),
              z = (octant >> 2) + (corner >> 2);
    return static_cast<std::size_t>(x + 3 * y + 9 * z);
  }
  /// Interpolates the values of a leaf.
  /// @param at  position in the leaf, each coordinate in [0, 1]
  [[nodiscard]] double interpolate(const HashedOctree::Place& place, const Imath::V3d& at) const;
};

/// Trilinear interpolation.
/// @param v  values at the corners, x fastest
inline double trilinear(const std::array<double, 8>& v, const Imath::V3d& at) {
  const auto mix = [](double a, double b, double t) { return a + (b - a) * t; };
  const double low = mix(mix(v[0], v[1], at.x), mix(v[2], v[3], at.x), at.y),
               high = mix(mix(v[4], v[5], at.x), mix(v[6], v[7], at.x), at.y);
  return mix(low, high, at.z);
}

/// Interpolates the values of a child of a block.
inline double interpolate(const CornerValues& values, int octant, const Imath::V3d& at) {
  std::array<double, 8> v;
  for (int c = 0; c < 8; ++c)
    v[static_cast<std::size_t>(c)] = values[AdaptiveTree::latticeIndex(octant, c)];
  return trilinear(v, at);
}

inline double AdaptiveTree::interpolate(const HashedOctree::Place& place,
                                        const Imath::V3d& at) const {
  return levelset::interpolate(values[place.block], place.leaf.octant(), at);
}

}  // namespace levelset
