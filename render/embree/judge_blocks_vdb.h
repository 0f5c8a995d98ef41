#pragma once

// Private to the Embree renderer: the crossing cells of a band, by blocks of 8³.

#include <Imath/ImathBox.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/vdb.h"
#include "render/filter.h"

namespace render {

/// A ray in index space; its parameter is the world distance, so the direction is not of unit
/// length.
struct IndexRay {
  Imath::V3d origin, direction, inverse;
  bool isParallel[3];  ///< no motion along that axis: its planes are never met

  IndexRay(const Imath::V3d& origin_, const Imath::V3d& direction_);
  [[nodiscard]] double at(int axis, double t) const { return origin[axis] + t * direction[axis]; }
  /// Where the ray meets the plane `axis` = k. The only such function: monotone in k, and the two
  /// cells at a plane get the same number, so no ray slips between them.
  [[nodiscard]] double plane(int axis, int k) const {
    return (static_cast<double>(k) - origin[axis]) * inverse[axis];
  }
};

/// The 8³ cells from `origin` on, as they lie in the tree: cell (i, j, k) spans the grid points
/// i … i+1, j … j+1, k … k+1.
struct SurfaceBlock {
  openvdb::Coord origin;
  std::array<const float*, 8>
      leaves;                  ///< values of the 2³ leaves that hold the corners; null: a tile
  std::array<float, 8> tiles;  ///< value where there is no leaf
  std::array<std::uint64_t, 8> crossing;  ///< bit y·8 + z of word x: the corners differ in sign
  std::array<std::uint8_t, 6> extent;  ///< of the crossing cells, in points: low x y z, high x y z

  /// Grid value at `origin` + (x, y, z), each in [0, 8].
  [[nodiscard]] double value(unsigned x, unsigned y, unsigned z) const {
    const unsigned n = (x >> 3) << 2 | (y >> 3) << 1 | z >> 3;
    const float* leaf = leaves[n];
    return static_cast<double>(leaf ? leaf[(x & 7) << 6 | (y & 7) << 3 | (z & 7)] : tiles[n]);
  }
  [[nodiscard]] Imath::Box3d bounds() const;
};

/// What is drawn of a grid.
struct DrawnField {
  const openvdb::FloatTree& tree;
  Filter filter = Filter::Trilinear;
};

/// Every block that holds a cell whose corners differ in sign, or where the spline may, in tree
/// order. The tree must outlive the blocks.
[[nodiscard]] std::vector<SurfaceBlock> surfaceBlocks(const DrawnField& field);

/// Where a ray changes sides.
struct SideChange {
  double t;
  bool enters;
};

enum class Search { FirstCrossing, AnyCrossing };

/// First sign change of the field on [near, far] inside the block. For AnyCrossing
/// the returned parameter is only some place in the cell that holds it.
[[nodiscard]] std::optional<double> findCrossing(const DrawnField& field, const SurfaceBlock& block,
                                                 const IndexRay& ray, double near, double far,
                                                 Search search);

/// Appends all sign changes of the field from `near` on inside the block, in their order.
void addCrossings(const DrawnField& field, const SurfaceBlock& block, const IndexRay& ray,
                  double near, std::vector<SideChange>& found);

}  // namespace render
