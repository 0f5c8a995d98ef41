#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstdint>
#include <span>
#include <vector>

#include "levelset/terrain/height_pyramid.h"

namespace levelset::terrain {

/// Rows of one level of a pyramid that one row of patches needs. Rows arrive from the south or from
/// the north; a border between two rows of patches belongs to both.
class LevelStrip {
 public:
  /// @param columns, rows  size of level 0 in samples
  LevelStrip(int level, int columns, int rows, int cells);

  /// Returns true if the level has the samples of a row of level 0.
  [[nodiscard]] bool has(int row) const;
  /// Takes a row of level 0 that the level has.
  /// @param heights  empty: all samples are missing
  /// @return true if the row completes a row of patches, which must be read before the next row
  bool take(int row, std::span<const float> heights, bool isNorthFirst);

  /// Row of patches that is complete.
  [[nodiscard]] int patchRow() const { return patchRow_; }
  /// Returns false if all samples of the row of patches are missing.
  [[nodiscard]] bool hasData() const { return hasData_; }
  /// Number of samples of a patch along x.
  [[nodiscard]] int patchWidth(int column) const;
  /// Copies the samples of a patch, row by row.
  void copyPatch(int column, std::vector<float>& heights) const;
  /// Continues with the row of patches in the north or in the south.
  void advance(bool isNorthFirst);

 private:
  /// Number of samples of the patches along y.
  [[nodiscard]] int patchHeight() const;
  [[nodiscard]] std::span<float> rowAt(int place) {
    return {heights_.data() + static_cast<std::size_t>(place) * static_cast<std::size_t>(width_),
            static_cast<std::size_t>(width_)};
  }

  int level_, columns_, rows_, cells_;
  int width_, height_;  ///< samples of the level
  int patchRow_ = -1;   ///< -1: no row has arrived
  bool hasData_ = false;
  std::vector<float> heights_;  ///< (cells + 1) rows of width_ samples, from the south
  std::vector<char> known_;     ///< for each row: has data
};

}  // namespace levelset::terrain
