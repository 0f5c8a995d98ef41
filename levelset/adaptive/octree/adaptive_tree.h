#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <vector>

#include "levelset/adaptive/octree/hashed_octree.h"
#include "levelset/adaptive/octree/leaf_interpolant.h"

namespace levelset {

/// Values at the corners of the eight children of a cell: a lattice of 3³ points, x fastest.
using CornerValues = std::array<float, 27>;

/// Gradients at the same points: the derivatives along x, then y, then z.
using CornerGradients = std::array<CornerValues, 3>;

/// Figures at the corners of the children of all blocks.
struct CornerData {
  std::vector<CornerValues> values;        ///< by number of block; the root has one
  std::vector<CornerGradients> gradients;  ///< empty for trilinear interpolation

  [[nodiscard]] bool isTricubic() const { return !gradients.empty(); }
  friend bool operator==(const CornerData&, const CornerData&) = default;
};

/// Octree with the figures of a block beside each block. A corner that several blocks share has the
/// same value in each.
struct AdaptiveTree {
  HashedOctree octree;
  CornerData data;
  Imath::V3d origin;  ///< lowest corner of the root, world units
  double unit = 0;    ///< edge of a cell of level 0, world units
  double tolerance = 0, halfWidth = 0;

  [[nodiscard]] Imath::V3d toWorld(const Imath::V3i& corner) const {
    return origin + Imath::V3d(corner * 2) * (unit / 2);  // the bits that buildAdaptive() reads
  }
  /// Value at a corner of a child.
  /// @param corner  bit 0 for the upper end along x, bit 1 along y, bit 2 along z
  [[nodiscard]] float corner(std::uint32_t block, int octant, int corner) const {
    return data.values[block][latticeIndex(octant, corner)];
  }
  [[nodiscard]] static std::size_t latticeIndex(int octant, int corner) {
    const int x = (octant & 1) + (corner & 1), y = (octant >> 1 & 1) + (corner >> 1 & 1),
              z = (octant >> 2) + (corner >> 2);
    return static_cast<std::size_t>(x + 3 * y + 9 * z);
  }
  /// Interpolant of a leaf.
  [[nodiscard]] LeafInterpolant interpolant(const HashedOctree::Place& place) const;
  /// Interpolates the values of a leaf.
  /// @param at  position in the leaf, each coordinate in [0, 1]
  [[nodiscard]] double interpolate(const HashedOctree::Place& place, const Imath::V3d& at) const {
    return interpolant(place).value(at);
  }
};

/// Interpolant of a child of a block.
/// @param edge  of the child, world units
inline LeafInterpolant interpolantOf(const CornerData& data, std::uint32_t block, int octant,
                                     double edge) {
  LeafInterpolant result;
  result.isTricubic = data.isTricubic();
  for (int c = 0; c < 8; ++c) {
    const std::size_t i = AdaptiveTree::latticeIndex(octant, c);
    const auto corner = static_cast<std::size_t>(c);
    result.values[corner] = data.values[block][i];
    if (!result.isTricubic) continue;
    for (std::size_t axis = 0; axis < 3; ++axis)
      result.slopes[axis][corner] = edge * data.gradients[block][axis][i];
  }
  return result;
}

inline LeafInterpolant AdaptiveTree::interpolant(const HashedOctree::Place& place) const {
  return interpolantOf(data, place.block, place.leaf.octant(), unit * place.leaf.edge());
}

}  // namespace levelset
