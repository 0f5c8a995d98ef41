#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <vector>

#include "levelset/terrain/height_field.h"
#include "levelset/terrain/height_pyramid.h"
#include "levelset/terrain/pyramid_parts.h"

namespace levelset::terrain {

/// Errors of all levels of a pyramid, from the patches of level 0, each read once. They have the
/// bits of heightPyramid(): an error is a largest distance, so the order of the patches does not
/// matter.
class PyramidErrors {
 public:
  static constexpr std::size_t kMostLevels = 32;

  /// @param pyramid  emptyPyramid() of the size
  PyramidErrors(int columns, int rows, const HeightPyramid& pyramid);

  /// Notes the height of a corner of a patch of level 0. All corners must be known before
  /// measure().
  /// @param column, row  number of patches before the corner along x and y
  void setCorner(int column, int row, float height) { corners_[corner(column, row)] = height; }

  /// Errors of one patch of level 0.
  struct PatchErrors {
    std::array<double, kMostLevels>
        aligned{};  ///< errors of complete cells, or parts of aligned ones
    std::array<CoarseCell::Deviation, kMostLevels> cut{};  ///< parts of cells that the border cuts
  };
  /// Measures a patch of level 0 that has some known samples. Several threads may call it.
  /// @param window  heights of the patch, without the samples beyond the border
  [[nodiscard]] PatchErrors measure(int column, int row, const HeightField& window) const;
  void add(int column, int row, const PatchErrors& errors);
  /// Notes a patch of level 0 without data. Errors above it are infinite.
  void addUnknown(int column, int row);

  /// Sets the errors of all levels but the finest. @param tolerance  is added to them
  void finish(double tolerance, HeightPyramid& pyramid) const;

  /// Memory for a terrain, bytes.
  [[nodiscard]] static double memoryUse(int columns, int rows, int cells);

 private:
  struct Level {
    int columns = 0;                    ///< patches along x
    int cellColumns = 0, cellRows = 0;  ///< cells along x and y
    std::vector<double> errors;         ///< errors of the patches
    /// Deviations of the cells of the last column, and of the last row.
    std::vector<CoarseCell::Deviation> lastColumn, lastRow;
  };
  /// Cell of a level that contains a patch of level 0, if its stride is larger than a patch.
  struct Cell {
    int column = 0, row = 0;            ///< number of the cell
    int firstColumn = 0, firstRow = 0;  ///< its corner, samples
    CoarseCell cell;
  };

  [[nodiscard]] std::size_t corner(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(patchColumns_ + 1) +
           static_cast<std::size_t>(column);
  }
  [[nodiscard]] Cell cellAbove(std::size_t level, int column, int row) const;
  [[nodiscard]] double errorInside(int stride, const HeightField& window) const;
  /// Deviation of a cell that the border cuts.
  [[nodiscard]] CoarseCell::Deviation& cutCell(Level& level, const Cell& cell);
  double& patchError(std::size_t level, int column, int row);

  int columns_, rows_, cells_;
  int cellBits_;  ///< binary logarithm of the cells of a patch
  int patchColumns_, patchRows_;
  std::vector<float> corners_;
  std::vector<Level> levels_;
};

}  // namespace levelset::terrain
