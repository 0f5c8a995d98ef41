#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace levelset {

/// Numbers of the simplices of the grid [Kuhn60]: the grid point with the smallest coordinates, and
/// a slot of kuhn_cell.h.
class GridSimplices {
 public:
  using Key = std::uint64_t;

  GridSimplices() = default;
  /// @param low  grid point below all that are numbered; those count up to 2^19 along each axis
  explicit GridSimplices(const Imath::V3i& low) : low_(low) {}

  [[nodiscard]] Key key(const Imath::V3i& at, std::uint32_t slot) const {
    Key key = 0;
    for (int axis = 0; axis < 3; ++axis)
      key = key << kBits | static_cast<Key>(at[axis] - low_[axis]);
    return key << kSlotBits | slot;
  }
  [[nodiscard]] Imath::V3i pointOf(Key key) const {
    Imath::V3i at;
    key >>= kSlotBits;
    for (int axis = 2; axis >= 0; --axis, key >>= kBits)
      at[axis] = low_[axis] + static_cast<int>(key & ((Key{1} << kBits) - 1));
    return at;
  }
  [[nodiscard]] static std::uint32_t slotOf(Key key) {
    return static_cast<std::uint32_t>(key & ((Key{1} << kSlotBits) - 1));
  }

 private:
  static constexpr int kBits = 19, kSlotBits = 5;
  Imath::V3i low_ = Imath::V3i(0);
};

/// Corner of a cell as an offset: bit 2 along x, bit 1 along y, bit 0 along z.
[[nodiscard]] inline Imath::V3i offsetOfCorner(std::uint32_t corner) {
  return {static_cast<int>(corner >> 2), static_cast<int>(corner >> 1 & 1),
          static_cast<int>(corner & 1)};
}

/// Crossing of a triangle and an edge of the grid.
struct GridCrossing {
  GridSimplices::Key edge = 0;
  double position = 0;  ///< from 0 at the lower end to 1
  std::uint32_t triangle = 0;
};

/// Side of a triangle on which a grid point lies: 1 in front, −1 behind; 0 only for triangles
/// without area. Grid points count as moved by an infinitesimal distance, mainly along x, then y,
/// then z [Edelsbrunner90]. So none lies on a triangle, and no edge of the grid meets an edge of
/// the mesh.
[[nodiscard]] int perturbedSide(const std::array<Imath::V3d, 3>& triangle, const Imath::V3i& at);

/// Returns true if the edge of the moved grid from a point to another corner of its cell crosses a
/// triangle. Exact.
/// @param step  the other corner, 1 to 7
[[nodiscard]] bool crossesTriangle(const std::array<Imath::V3d, 3>& triangle, const Imath::V3i& at,
                                   std::uint32_t step);

/// Finds all crossings of the triangles of a mesh and the edges of the tetrahedra of the grid, by
/// edge, position and triangle.
/// @param points  vertices, voxels
[[nodiscard]] std::vector<GridCrossing> findGridCrossings(
    const std::vector<Imath::V3d>& points,
    const std::vector<std::array<std::uint32_t, 3>>& triangles, const GridSimplices& simplices);

}  // namespace levelset
