#pragma once

// Private to the Embree renderer: the cells of a band that the surface crosses, in blocks of 8³.

#include <Imath/ImathBox.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "levelset/vdb.h"
#include "render/filter.h"

namespace render {

/// A ray in the index space of a band. Its parameter is the world distance, so the direction does
/// not have unit length.
struct IndexRay {
  Imath::V3d origin, direction, inverse;
  bool isParallel[3];  ///< true for an axis along which the ray does not move, so it meets no plane
                       ///< across the axis

  IndexRay(const Imath::V3d& origin_, const Imath::V3d& direction_);
  [[nodiscard]] double at(int axis, double t) const { return origin[axis] + t * direction[axis]; }
  /// Parameter at which the ray meets the plane `axis` = k. All cells use this function. It is
  /// monotone in k, and both cells at a plane get the same number, so no ray slips between them.
  [[nodiscard]] double plane(int axis, int k) const {
    return (static_cast<double>(k) - origin[axis]) * inverse[axis];
  }
};

/// The 8³ cells from `origin` on, and pointers to their values in OpenVDB's tree. Cell (i, j, k)
/// spans the grid points i … i+1, j … j+1, k … k+1. Shares no code with the kernel's bricks, so
/// that the judge is an independent check of them.
struct SurfaceBlock {
  openvdb::Coord origin;
  std::array<const float*, 8> leaves;  ///< values of the 2³ leaves that hold the corners of the
                                       ///< cells; null where the tree has a tile
  std::array<float, 8> tiles;          ///< values of the tiles where `leaves` is null, φ
  std::array<std::uint64_t, 8>
      crossing;  ///< bit y·8 + z of word x: the surface may cross cell (x, y, z)
  /// Range of the grid points of the cells marked in `crossing`, relative to `origin`: low x y z,
  /// high x y z.
  std::array<std::uint8_t, 6> extent;

  /// Grid value at `origin` + (x, y, z), each in [0, 8].
  [[nodiscard]] double value(unsigned x, unsigned y, unsigned z) const {
    const unsigned n = (x >> 3) << 2 | (y >> 3) << 1 | z >> 3;
    const float* leaf = leaves[n];
    return static_cast<double>(leaf ? leaf[(x & 7) << 6 | (y & 7) << 3 | (z & 7)] : tiles[n]);
  }
  /// Box of the cells marked in `crossing`, index space.
  [[nodiscard]] Imath::Box3d bounds() const;
};

/// A grid of φ and its interpolation.
struct DrawnField {
  const openvdb::FloatTree& tree;
  Filter filter = Filter::Trilinear;
  /// Box of the cells in which the surface is drawn.
  openvdb::CoordBBox cells = openvdb::CoordBBox::inf();
};

/// All blocks with a cell that the surface may cross, sorted by origin. For the trilinear filter,
/// these are the cells whose corners differ in sign. For a spline filter, these are the cells in
/// which bounds on the spline allow a zero. The tree must outlive the blocks.
[[nodiscard]] std::vector<SurfaceBlock> surfaceBlocks(const DrawnField& field);

/// A point of a ray at which it enters or leaves the solid: parameter `t` of the ray, world units.
struct SideChange {
  double t;
  bool enters;
};

enum class Search { FirstCrossing, AnyCrossing };

/// Finds the first sign change of the field along the ray for parameters in [near, far] inside the
/// block. With AnyCrossing, the returned parameter may lie anywhere in the cell that contains the
/// sign change.
[[nodiscard]] std::optional<double> findCrossing(const DrawnField& field, const SurfaceBlock& block,
                                                 const IndexRay& ray, double near, double far,
                                                 Search search);

/// Appends all sign changes of the field along the ray beyond the parameter `near` inside the
/// block, in ascending order.
void addCrossings(const DrawnField& field, const SurfaceBlock& block, const IndexRay& ray,
                  double near, std::vector<SideChange>& found);

}  // namespace render
