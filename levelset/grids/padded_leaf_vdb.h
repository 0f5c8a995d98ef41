#pragma once

// Internal header: public headers must not include it. Dense copies of a leaf block together with
// grid points of its neighbours.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>

#include "levelset/vdb.h"

namespace levelset {

/// Values of a block of 8³ grid points: an array with x slowest, or one constant.
struct BlockValues {
  const float* values = nullptr;  ///< null: `constant` at all grid points
  float constant = 0;
};

/// Returns the values of the leaf block that begins at `origin`, or of its tile.
template <typename Accessor>
[[nodiscard]] BlockValues blockValues(const Accessor& accessor, const openvdb::Coord& origin) {
  if (const auto* leaf = accessor.probeConstLeaf(origin)) return {leaf->buffer().data(), 0};
  return {nullptr, accessor.getValue(origin)};
}

/// Copies a block and the grid points around it to a dense cube, x slowest and rows along z.
/// @param before, after  number of grid points before and after the block, the same on all axes
/// @param row  number of floats from one row to the next in `target`, at least 8 + before + after
/// @param valuesAt  (Coord step): returns the BlockValues of the block that lies `step` blocks away
template <typename ValuesAt>
void copyPadded(int before, int after, int row, float* target, const ValuesAt& valuesAt) {
  const int first = -((before + 7) / 8), last = (after + 7) / 8, side = 8 + before + after;
  // Range [from, to) of the grid points to copy from the block `k` blocks away, counted from the
  // first grid point of the central block.
  const auto from = [&](int k) { return std::max(8 * k, -before); };
  const auto to = [&](int k) { return std::min(8 * k + 8, 8 + after); };
  for (int bx = first; bx <= last; ++bx)
    for (int by = first; by <= last; ++by)
      for (int bz = first; bz <= last; ++bz) {
        const BlockValues source = valuesAt(openvdb::Coord(bx, by, bz));
        const auto count = static_cast<std::size_t>(to(bz) - from(bz));
        for (int x = from(bx); x < to(bx); ++x)
          for (int y = from(by); y < to(by); ++y) {
            float* out = target +
                         (static_cast<std::ptrdiff_t>(x + before) * side + y + before) * row +
                         from(bz) + before;
            const float* in = source.values
                                  ? source.values + ((x & 7) << 6) + ((y & 7) << 3) + (from(bz) & 7)
                                  : nullptr;
            // A constant size makes the copy one or two instructions instead of a call.
            if (!in)
              std::fill_n(out, count, source.constant);
            else if (count == 8)
              std::memcpy(out, in, 8 * sizeof(float));
            else if (count == 4)
              std::memcpy(out, in, 4 * sizeof(float));
            else
              for (std::size_t i = 0; i < count; ++i) out[i] = in[i];
          }
      }
}

/// Copies the leaf block that begins at `origin` and the grid points around it, see copyPadded().
/// The rows follow each other without a gap.
template <typename Accessor>
void copyPaddedLeaf(const Accessor& accessor, const openvdb::Coord& origin, int before, int after,
                    float* target) {
  copyPadded(before, after, 8 + before + after, target, [&](const openvdb::Coord& step) {
    return blockValues(accessor, origin.offsetBy(8 * step.x(), 8 * step.y(), 8 * step.z()));
  });
}

/// A leaf block with a border of `Pad` grid points on each side; rows run along z. If `Row` is
/// longer than the side, vector instructions may read beyond the end of a row.
template <int Pad, int Row = 8 + 2 * Pad>
struct PaddedLeaf {
  static constexpr int kPad = Pad, kSide = 8 + 2 * Pad, kRow = Row;
  /// Distance in `values` between neighbours along x and y.
  static constexpr int kStepX = kSide * kRow, kStepY = kRow;
  alignas(64) std::array<float, static_cast<std::size_t>(kSide* kSide* kRow)> values;

  /// Returns the index of the grid point (x, y, z) of the leaf; the border has coordinates below 0
  /// and above 7.
  [[nodiscard]] static constexpr std::size_t slot(int x, int y, int z) {
    return static_cast<std::size_t>(((x + kPad) * kSide + y + kPad) * kRow + z + kPad);
  }
  /// Returns the address of the value at a grid point.
  [[nodiscard]] const float* at(int x, int y, int z) const { return values.data() + slot(x, y, z); }
  /// Copies a leaf block and its border, see copyPadded().
  template <typename ValuesAt>
  void fill(const ValuesAt& valuesAt) {
    copyPadded(kPad, kPad, kRow, values.data(), valuesAt);
  }
};

}  // namespace levelset
