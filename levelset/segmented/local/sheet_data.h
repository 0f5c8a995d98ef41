#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace levelset {

/// Crossings of the surfaces of a field with sheets. A sheet may have the same region on both
/// sides, so labels do not tell where it is. The field stores which edges of the tetrahedra of the
/// grid it crosses, and where. Keys are 32 × voxel + slot: the simplices of a grid point, as in
/// kuhn_cell.h.
struct SheetData {
  static constexpr std::uint32_t kSlots = 32;

  std::vector<std::uint32_t> firstEdge, firstPoint;  ///< by block, and one more for the ends
  std::vector<std::uint16_t> edges;  ///< keys of crossed edges, ascending in each block
  std::vector<float> positions;      ///< along these edges, from 0 to 1
  /// Keys of simplices that hold a point of a rim or a junction, ascending in each block. An edge
  /// among them is crossed by several surfaces, which meet at that point or near it.
  std::vector<std::uint16_t> pointKeys;
  std::vector<Imath::V3f> points;     ///< these points, voxels from the grid point
  std::vector<std::uint16_t> owners;  ///< labels of the regions that have sheets inside, ascending

  [[nodiscard]] static std::uint16_t key(std::uint32_t voxel, std::uint32_t slot) {
    return static_cast<std::uint16_t>(voxel * kSlots + slot);
  }
  [[nodiscard]] std::span<const std::uint16_t> edgesOf(std::size_t block) const {
    return std::span(edges).subspan(firstEdge[block], firstEdge[block + 1] - firstEdge[block]);
  }
  /// Position of a crossing along its edge; the middle for an edge that is not crossed.
  [[nodiscard]] float positionOf(std::size_t block, std::uint16_t key) const;
  /// Point of a rim or junction in a simplex; null if there is none.
  [[nodiscard]] const Imath::V3f* pointOf(std::size_t block, std::uint16_t key) const;
  [[nodiscard]] std::size_t memoryUse() const;  ///< bytes
  [[nodiscard]] std::uint64_t contentHash() const;
};

}  // namespace levelset
