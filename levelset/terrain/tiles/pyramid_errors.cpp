#include "levelset/terrain/tiles/pyramid_errors.h"

#include <algorithm>
#include <bit>
#include <limits>

namespace levelset::terrain {
namespace {

constexpr double kMissingBelow = std::numeric_limits<double>::infinity();

}  // namespace

PyramidErrors::PyramidErrors(int columns, int rows, const HeightPyramid& pyramid)
    : columns_(columns),
      rows_(rows),
      cells_(pyramid.cells),
      cellBits_(std::countr_zero(static_cast<unsigned>(pyramid.cells))),
      patchColumns_(pyramid.levels[0].columns),
      patchRows_(pyramid.levels[0].rows),
      corners_(
          static_cast<std::size_t>(patchColumns_ + 1) * static_cast<std::size_t>(patchRows_ + 1),
          kMissingHeight) {
  for (std::size_t n = 0; n < pyramid.levels.size(); ++n) {
    const int bits = static_cast<int>(n);
    Level level{.columns = pyramid.levels[n].columns,
                .cellColumns = ((columns - 2) >> bits) + 1,
                .cellRows = ((rows - 2) >> bits) + 1,
                .errors = {},
                .lastColumn = {},
                .lastRow = {}};
    if (n > 0) level.errors.resize(pyramid.levels[n].patches.size());
    if (bits > cellBits_) {
      level.lastColumn.resize(static_cast<std::size_t>(level.cellRows));
      level.lastRow.resize(static_cast<std::size_t>(level.cellColumns));
    }
    levels_.push_back(std::move(level));
  }
}

double PyramidErrors::memoryUse(int columns, int rows, int cells) {
  const double across = (columns - 1) / cells + 2.0, along = (rows - 1) / cells + 2.0;
  return across * along * sizeof(float) + across * along / 3 * sizeof(double) +
         (across + along) * sizeof(CoarseCell::Deviation) + across * sizeof(PatchErrors);
}

PyramidErrors::Cell PyramidErrors::cellAbove(std::size_t level, int column, int row) const {
  const int bits = static_cast<int>(level), up = bits - cellBits_;
  const int cellColumn = column >> up, cellRow = row >> up;
  const std::int64_t stride = std::int64_t{1} << bits;
  const int firstColumn = static_cast<int>(cellColumn * stride),
            firstRow = static_cast<int>(cellRow * stride);
  const int lastColumn =
                static_cast<int>(std::min<std::int64_t>(firstColumn + stride, columns_ - 1)),
            lastRow = static_cast<int>(std::min<std::int64_t>(firstRow + stride, rows_ - 1));
  // A corner is that of a patch, as the stride is that of several patches.
  const int west = cellColumn << up, east = std::min((cellColumn + 1) << up, patchColumns_),
            south = cellRow << up, north = std::min((cellRow + 1) << up, patchRows_);
  const auto height = [&](int c, int r) { return static_cast<double>(corners_[corner(c, r)]); };
  return {.column = cellColumn,
          .row = cellRow,
          .firstColumn = firstColumn,
          .firstRow = firstRow,
          .cell = CoarseCell(lastColumn - firstColumn, lastRow - firstRow,
                             {.low = height(west, south),
                              .alongX = height(east, south),
                              .alongY = height(west, north),
                              .high = height(east, north)})};
}

/// Largest error of the cells of a stride in a patch.
double PyramidErrors::errorInside(int stride, const HeightField& window) const {
  double error = 0;
  for (int j = 0; j < window.rows - 1; j += stride)
    for (int i = 0; i < window.columns - 1; i += stride)
      error =
          std::max(error, coarseCellError(window, i, j, std::min(i + stride, window.columns - 1),
                                          std::min(j + stride, window.rows - 1)));
  return error;
}

PyramidErrors::PatchErrors PyramidErrors::measure(int column, int row,
                                                  const HeightField& window) const {
  PatchErrors errors;
  for (std::size_t level = 1; level < levels_.size(); ++level) {
    if (static_cast<int>(level) <= cellBits_) {
      errors.aligned[level] = errorInside(1 << level, window);
      continue;
    }
    const Cell above = cellAbove(level, column, row);
    CoarseCell::Deviation deviation;
    above.cell.compare(window, above.firstColumn - column * cells_, above.firstRow - row * cells_,
                       deviation);
    if (above.cell.isAligned())
      errors.aligned[level] = deviation.error;
    else
      errors.cut[level] = deviation;
  }
  return errors;
}

CoarseCell::Deviation& PyramidErrors::cutCell(Level& level, const Cell& cell) {
  return cell.column + 1 == level.cellColumns
             ? level.lastColumn[static_cast<std::size_t>(cell.row)]
             : level.lastRow[static_cast<std::size_t>(cell.column)];
}

double& PyramidErrors::patchError(std::size_t level, int column, int row) {
  const auto width = static_cast<std::size_t>(levels_[level].columns);
  return levels_[level].errors[static_cast<std::size_t>(row >> level) * width +
                               static_cast<std::size_t>(column >> level)];
}

void PyramidErrors::add(int column, int row, const PatchErrors& errors) {
  for (std::size_t level = 1; level < levels_.size(); ++level) {
    double& error = patchError(level, column, row);
    error = std::max(error, errors.aligned[level]);
    if (static_cast<int>(level) <= cellBits_) continue;
    if (const Cell above = cellAbove(level, column, row); !above.cell.isAligned())
      cutCell(levels_[level], above).raiseTo(errors.cut[level]);
  }
}

void PyramidErrors::addUnknown(int column, int row) {
  for (std::size_t level = 1; level < levels_.size(); ++level)
    patchError(level, column, row) = kMissingBelow;
}

void PyramidErrors::finish(double tolerance, HeightPyramid& pyramid) const {
  for (std::size_t n = 1; n < levels_.size(); ++n) {
    const Level& level = levels_[n];
    std::vector<double> errors = level.errors;
    // Raises the error of the patch that contains a cell.
    const auto raise = [&](int cellColumn, int cellRow, const CoarseCell::Deviation& deviation) {
      const int up = static_cast<int>(n) - cellBits_;
      const Cell above = cellAbove(n, cellColumn << up, cellRow << up);
      if (above.cell.isAligned()) return;
      double& error = errors[static_cast<std::size_t>(cellRow >> cellBits_) *
                                 static_cast<std::size_t>(level.columns) +
                             static_cast<std::size_t>(cellColumn >> cellBits_)];
      error = std::max(error, above.cell.bound(deviation));
    };
    for (std::size_t row = 0; row < level.lastColumn.size(); ++row)
      raise(level.cellColumns - 1, static_cast<int>(row), level.lastColumn[row]);
    for (std::size_t column = 0; column + 1 < level.lastRow.size(); ++column)
      raise(static_cast<int>(column), level.cellRows - 1, level.lastRow[column]);
    for (std::size_t k = 0; k < errors.size(); ++k)
      pyramid.levels[n].patches[k].error = heightRoundedUp(errors[k] + tolerance);
  }
}

}  // namespace levelset::terrain
