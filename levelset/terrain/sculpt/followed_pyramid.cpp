#include "levelset/terrain/sculpt/followed_pyramid.h"

#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "levelset/memory/memory_limit.h"
#include "levelset/terrain/pyramid_parts.h"

namespace levelset::terrain {
namespace {

/// Squares of 2^shift samples that have a sample of a range. Neighbours share their border.
SampleRange squaresAt(const SampleRange& samples, int shift, int columns, int rows) {
  // Sizes are below 2^30, and the shifts of a pyramid below 31.
  const auto first = [&](int sample) {
    const std::int64_t side = std::int64_t{1} << shift;
    return static_cast<int>(std::max<std::int64_t>(0, (sample + side - 1) / side - 1));
  };
  return {.firstColumn = first(samples.firstColumn),
          .firstRow = first(samples.firstRow),
          .lastColumn = std::min(columns - 1, samples.lastColumn >> shift),
          .lastRow = std::min(rows - 1, samples.lastRow >> shift)};
}

template <typename Function>
void forEachSquare(const SampleRange& range, int grain, const Function& function) {
  tbb::parallel_for(tbb::blocked_range2d<int>(
                        range.firstRow, range.lastRow + 1, static_cast<std::size_t>(grain),
                        range.firstColumn, range.lastColumn + 1, static_cast<std::size_t>(grain)),
                    [&](const tbb::blocked_range2d<int>& part) {
                      for (int row = part.rows().begin(); row < part.rows().end(); ++row)
                        for (int column = part.cols().begin(); column < part.cols().end(); ++column)
                          function(column, row);
                    });
}

/// Zeros become positive, so that the order of the heights does not matter.
void include(PyramidPatch& patch, float lowest, float highest) {
  patch.lowest = std::fmin(patch.lowest, lowest + 0.0F);
  patch.highest = std::fmax(patch.highest, highest + 0.0F);
}

}  // namespace

FollowedPyramid::FollowedPyramid(const HeightField& field, const PyramidOptions& options) {
  requireHeights(field);
  requirePyramid(field.columns, field.rows, options.cells);
  requireMemory(sizeof(PyramidPatch) * patchCount(field.columns, field.rows, options.cells),
                memoryLeft(memoryLimit(options.maxMemory)));
  pyramid_ = emptyPyramid(field.columns, field.rows, options.cells);
  const SampleRange all{.lastColumn = field.columns - 1, .lastRow = field.rows - 1};
  cells_.resize(pyramid_.levels.size());
  for (std::size_t level = 1; level < cells_.size(); ++level) {
    CellLevel& cells = cells_[level];
    cells.columns = ((field.columns - 2) >> level) + 1;
    cells.rows = ((field.rows - 2) >> level) + 1;
    requireMemory(static_cast<double>(cells.columns) * cells.rows * sizeof(float),
                  memoryLeft(memoryLimit(options.maxMemory)));
    cells.errors.resize(static_cast<std::size_t>(cells.columns) *
                        static_cast<std::size_t>(cells.rows));
  }
  for (std::size_t level = 0; level < cells_.size(); ++level) {
    const PyramidLevel& patches = pyramid_.levels[level];
    if (level > 0)
      measureCells(
          field, level,
          squaresAt(all, static_cast<int>(level), cells_[level].columns, cells_[level].rows));
    measurePatches(field, level, {.lastColumn = patches.columns - 1, .lastRow = patches.rows - 1});
    report(options.progress, static_cast<double>(level + 1) / static_cast<double>(cells_.size()));
  }
}

void FollowedPyramid::update(const HeightField& field, const SampleRange& changed) {
  if (changed.isEmpty()) return;
  int patchShift = 0;
  while ((1 << patchShift) < pyramid_.cells) ++patchShift;
  for (std::size_t level = 0; level < cells_.size(); ++level) {
    const auto shift = static_cast<int>(level);
    if (level > 0)
      measureCells(field, level,
                   squaresAt(changed, shift, cells_[level].columns, cells_[level].rows));
    measurePatches(field, level,
                   squaresAt(changed, patchShift + shift, pyramid_.levels[level].columns,
                             pyramid_.levels[level].rows));
  }
}

void FollowedPyramid::measureCells(const HeightField& field, std::size_t level,
                                   const SampleRange& range) {
  CellLevel& cells = cells_[level];
  const auto last = [&](int square, int samples) {
    return static_cast<int>(
        std::min<std::int64_t>((static_cast<std::int64_t>(square) + 1) << level, samples - 1));
  };
  // A task has about a thousand samples.
  const int grain = std::max(1, 32 >> level);
  forEachSquare(range, grain, [&](int column, int row) {
    cells.errors[static_cast<std::size_t>(row) * static_cast<std::size_t>(cells.columns) +
                 static_cast<std::size_t>(column)] =
        heightRoundedUp(coarseCellError(field, column << level, row << level,
                                        last(column, field.columns), last(row, field.rows)));
  });
}

void FollowedPyramid::measurePatches(const HeightField& field, std::size_t level,
                                     const SampleRange& range) {
  PyramidLevel& patches = pyramid_.levels[level];
  const int side = pyramid_.cells;
  forEachSquare(range, 1, [&](int column, int row) {
    PyramidPatch patch{.lowest = kMissingHeight, .highest = kMissingHeight};
    if (level == 0) {
      for (int j = row * side; j <= std::min((row + 1) * side, field.rows - 1); ++j)
        for (int i = column * side; i <= std::min((column + 1) * side, field.columns - 1); ++i)
          include(patch, field.at(i, j), field.at(i, j));
    } else {
      const CellLevel& cells = cells_[level];
      for (int j = row * side; j < std::min((row + 1) * side, cells.rows); ++j)
        for (int i = column * side; i < std::min((column + 1) * side, cells.columns); ++i)
          patch.error = std::max(
              patch.error,
              cells.errors[static_cast<std::size_t>(j) * static_cast<std::size_t>(cells.columns) +
                           static_cast<std::size_t>(i)]);
      patch.bound = patch.error;
      const PyramidLevel& finer = pyramid_.levels[level - 1];
      for (int j = 2 * row; j < std::min(2 * row + 2, finer.rows); ++j)
        for (int i = 2 * column; i < std::min(2 * column + 2, finer.columns); ++i) {
          const PyramidPatch& child = finer.at(i, j);
          include(patch, child.lowest, child.highest);
          patch.bound = std::max(patch.bound, child.bound);
        }
    }
    patches.patches[static_cast<std::size_t>(row) * static_cast<std::size_t>(patches.columns) +
                    static_cast<std::size_t>(column)] = patch;
  });
}

}  // namespace levelset::terrain
