#pragma once

#include <Imath/ImathVec.h>

#include <cstdint>

namespace levelset {

/// Largest depth of an octree. Positions and the level then fit into 64 bits.
inline constexpr int kMaxOctreeDepth = 19;

/// Locational key of a cell of an octree: its position and its size [Sigg06, 3.1]. The unit of
/// length is the edge of a finest cell. A cell has level 0 if it is a finest one; its parent has
/// the next level.
struct CellKey {
  std::uint32_t x = 0, y = 0, z = 0;  ///< lowest corner; multiples of the edge
  int level = 0;

  [[nodiscard]] std::uint32_t edge() const { return std::uint32_t{1} << level; }
  [[nodiscard]] Imath::V3i low() const { return Imath::V3i(int(x), int(y), int(z)); }
  /// Ancestor at a level, from the level of the cell on.
  [[nodiscard]] CellKey ancestor(int at) const {
    const std::uint32_t mask = ~((std::uint32_t{1} << at) - 1);
    return {x & mask, y & mask, z & mask, at};
  }
  [[nodiscard]] CellKey parent() const { return ancestor(level + 1); }
  /// Child in an octant: bit 0 for the upper half along x, bit 1 along y, bit 2 along z.
  [[nodiscard]] CellKey child(int octant) const {
    const std::uint32_t half = edge() >> 1;
    return {x + (octant & 1 ? half : 0), y + (octant & 2 ? half : 0), z + (octant & 4 ? half : 0),
            level - 1};
  }
  /// Octant of the parent that holds the cell.
  [[nodiscard]] int octant() const {
    return int((x >> level & 1) | (y >> level & 1) << 1 | (z >> level & 1) << 2);
  }
  /// All members in 62 bits.
  [[nodiscard]] std::uint64_t packed() const {
    return x | std::uint64_t{y} << 19 | std::uint64_t{z} << 38 | std::uint64_t(level) << 57;
  }
  [[nodiscard]] static CellKey unpacked(std::uint64_t bits) {
    constexpr std::uint32_t kMask = (1u << 19) - 1;
    return {std::uint32_t(bits) & kMask, std::uint32_t(bits >> 19) & kMask,
            std::uint32_t(bits >> 38) & kMask, int(bits >> 57)};
  }
  bool operator==(const CellKey&) const = default;
};

}  // namespace levelset
