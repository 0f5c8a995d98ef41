#pragma once

// Internal header of levelset: public headers must not include it.

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace levelset {

/// Owners of the grid points in and around a block of 8³: ranks or labels.
class BlockSurroundings {
 public:
  using Owner = std::uint16_t;
  static constexpr int kPad = 3;    ///< grid points around the block
  static constexpr int kReach = 2;  ///< largest distance of others() along each axis

  /// @param x, y, z  in the block, from −kPad to 7 + kPad
  [[nodiscard]] Owner at(int x, int y, int z) const { return owners_[index(x, y, z)]; }

  /// Owners of the grid points (x, y, 0…).
  [[nodiscard]] const Owner* row(int x, int y) const { return &owners_[index(x, y, 0)]; }

  /// Fills the surroundings.
  /// @tparam RowOf  void(int i, int j, int k, int x, int y, Owner* row): writes the owners of the
  ///         row (x, y, 0…7) of the block at the offset (i, j, k), each −1, 0 or 1
  template <typename RowOf>
  void fill(const RowOf& rowOf) {
    const auto blockOf = [](int x) { return x < 0 ? -1 : x < 8 ? 0 : 1; };
    std::array<Owner, 8> row;
    for (int x = -kPad; x < 8 + kPad; ++x)
      for (int y = -kPad; y < 8 + kPad; ++y) {
        const int i = blockOf(x), j = blockOf(y);
        Owner* line = &owners_[index(x, y, -kPad)];
        rowOf(i, j, -1, x & 7, y & 7, row.data());
        std::copy(row.end() - kPad, row.end(), line);
        rowOf(i, j, 0, x & 7, y & 7, row.data());
        std::copy(row.begin(), row.end(), line + kPad);
        rowOf(i, j, 1, x & 7, y & 7, row.data());
        std::copy(row.begin(), row.begin() + kPad, line + kPad + 8);
      }
    findPalette();
  }

  /// Owners up to kReach away from the block, ascending.
  [[nodiscard]] const std::vector<Owner>& palette() const { return palette_; }

  /// Prepares others() for a palette of more than one owner.
  void findNeighbours();
  /// Finds the owners other than `own` up to one, or up to two grid points away along each axis,
  /// ascending.
  /// @param n  offset in the block, z fastest
  void others(std::uint32_t n, Owner own, int reach, std::vector<Owner>& result) const;

  /// Owners around a grid point where there are few of them.
  struct Near {
    int count;  ///< others up to two grid points away: 0, 1, or 2 for several or unknown ones
    Owner other = 0;
    bool isAdjacent = false;  ///< up to one grid point away
  };
  /// Finds the only other owner. Most grid points have one at most, and need no lists.
  [[nodiscard]] Near near(std::uint32_t n, Owner own) const {
    if (palette_.size() > kBits) return {2};
    std::size_t code = 0;
    while (palette_[code] != own) ++code;
    const std::uint32_t mask = masks_[1][n] & ~(1u << code);
    if (mask == 0) return {0};
    if ((mask & (mask - 1)) != 0) return {2};
    std::size_t other = 0;
    while (!(mask >> other & 1)) ++other;
    return {1, palette_[other], (masks_[0][n] & mask) != 0};
  }

 private:
  static constexpr int kSide = 8 + 2 * kPad;
  // More owners than bits are looked up one by one.
  static constexpr std::size_t kBits = 32;

  [[nodiscard]] static std::size_t index(int x, int y, int z) {
    return static_cast<std::size_t>(((x + kPad) * kSide + y + kPad) * kSide + z + kPad);
  }
  void findPalette();
  [[nodiscard]] std::array<std::uint32_t, 512> dilated(int reach) const;

  std::array<Owner, kSide * kSide * kSide> owners_;
  std::vector<Owner> palette_;
  /// Bits of the palette, by voxel: owners up to one and two grid points away.
  std::array<std::array<std::uint32_t, 512>, 2> masks_;
};

}  // namespace levelset
