#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <cstdint>

/// Simplices of a grid cell that is cut into six tetrahedra [Kuhn60]. All contain the diagonal from
/// the lowest to the highest corner. The cut is the same in all cells, so faces of neighbours
/// match.
namespace levelset::kuhn {

/// Corner of a cell: bit 2 for the upper end along x, bit 1 along y, bit 0 along z.
using Corner = std::uint32_t;

/// Corners of the tetrahedra, along a path of grid edges. Odd ones are mirrored.
inline constexpr std::array<std::array<Corner, 4>, 6> kTetrahedra = {
    {{0, 4, 6, 7}, {0, 4, 5, 7}, {0, 2, 3, 7}, {0, 2, 6, 7}, {0, 1, 5, 7}, {0, 1, 3, 7}}};

/// Every simplex is a chain: the bits of a corner contain those of the corner before. It belongs to
/// the grid point of its lowest corner, and has a slot there.
inline constexpr std::uint32_t kSlots = 25;

/// @param step  upper corner, seen from the lower one: 1 to 7
[[nodiscard]] constexpr std::uint32_t edgeSlot(Corner step) {
  return step - 1;
}

struct FaceSteps {
  Corner middle, upper;
};
inline constexpr std::array<FaceSteps, 12> kFaces = {{{1, 3},
                                                      {1, 5},
                                                      {1, 7},
                                                      {2, 3},
                                                      {2, 6},
                                                      {2, 7},
                                                      {3, 7},
                                                      {4, 5},
                                                      {4, 6},
                                                      {4, 7},
                                                      {5, 7},
                                                      {6, 7}}};
/// @param middle, upper  the other corners, seen from the lowest one
[[nodiscard]] constexpr std::uint32_t faceSlot(Corner middle, Corner upper) {
  std::uint32_t slot = 0;
  while (kFaces[slot].middle != middle || kFaces[slot].upper != upper) ++slot;
  return 7 + slot;
}
[[nodiscard]] constexpr std::uint32_t tetrahedronSlot(std::size_t tetrahedron) {
  return 19 + static_cast<std::uint32_t>(tetrahedron);
}

/// Least distance of a vertex from the ends of its edge, voxels. Where an interface passes through
/// a grid point, it keeps triangles from collapsing to the point.
inline constexpr double kEndGap = 1e-5;

}  // namespace levelset::kuhn
