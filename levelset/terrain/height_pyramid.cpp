#include "levelset/terrain/height_pyramid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/memory/memory_limit.h"
#include "levelset/progress_gate.h"
#include "levelset/terrain/pyramid_parts.h"

namespace levelset {
namespace {

PyramidPatch measurePatch(const HeightField& field, int cells, int level, int column, int row) {
  PyramidPatch patch{.lowest = std::numeric_limits<float>::infinity(),
                     .highest = -std::numeric_limits<float>::infinity()};
  // Sizes are below 2^30 samples, so that sums and products fit 64 bits.
  const std::int64_t stride = std::int64_t{1} << level, side = cells * stride;
  const auto lastColumn =
      static_cast<int>(std::min<std::int64_t>((column + 1) * side, field.columns - 1));
  const auto lastRow = static_cast<int>(std::min<std::int64_t>((row + 1) * side, field.rows - 1));
  const auto firstColumn = static_cast<int>(column * side), firstRow = static_cast<int>(row * side);
  for (int j = firstRow; j <= lastRow; ++j)
    for (int i = firstColumn; i <= lastColumn; ++i) {
      const float height = field.at(i, j) + 0.F;  // of the two zeros always the positive one
      if (std::isnan(height)) continue;
      patch.lowest = std::min(patch.lowest, height);
      patch.highest = std::max(patch.highest, height);
    }
  if (patch.lowest > patch.highest) patch.lowest = patch.highest = kMissingHeight;
  if (level == 0) return patch;
  double error = 0;
  for (std::int64_t j = firstRow; j < lastRow; j += stride)
    for (std::int64_t i = firstColumn; i < lastColumn; i += stride)
      error = std::max(
          error, coarseCellError(field, static_cast<int>(i), static_cast<int>(j),
                                 static_cast<int>(std::min<std::int64_t>(i + stride, lastColumn)),
                                 static_cast<int>(std::min<std::int64_t>(j + stride, lastRow))));
  patch.error = heightRoundedUp(error);
  return patch;
}

}  // namespace

double coarseCellError(const HeightField& field, int firstColumn, int firstRow, int lastColumn,
                       int lastRow) {
  const auto at = [&](int c, int r) { return static_cast<double>(field.at(c, r)); };
  const terrain::CoarseCell cell(lastColumn - firstColumn, lastRow - firstRow,
                                 {.low = at(firstColumn, firstRow),
                                  .alongX = at(lastColumn, firstRow),
                                  .alongY = at(firstColumn, lastRow),
                                  .high = at(lastColumn, lastRow)});
  terrain::CoarseCell::Deviation deviation;
  cell.compare(field, firstColumn, firstRow, deviation);
  return cell.bound(deviation);
}

HeightPyramid heightPyramid(const HeightField& field, const PyramidOptions& options) {
  requireHeights(field);
  terrain::requirePyramid(field.columns, field.rows, options.cells);
  requireMemory(
      sizeof(PyramidPatch) * terrain::patchCount(field.columns, field.rows, options.cells),
      memoryLeft(memoryLimit(options.maxMemory)));
  HeightPyramid pyramid = terrain::emptyPyramid(field.columns, field.rows, options.cells);
  std::size_t total = 0;
  for (const PyramidLevel& level : pyramid.levels) total += level.patches.size();
  ProgressGate gate(options.progress, total);
  for (std::size_t n = 0; n < pyramid.levels.size(); ++n) {
    PyramidLevel& level = pyramid.levels[n];
    tbb::parallel_for(std::size_t{0}, level.patches.size(), [&](std::size_t patch) {
      const auto width = static_cast<std::size_t>(level.columns);
      level.patches[patch] =
          measurePatch(field, options.cells, static_cast<int>(n), static_cast<int>(patch % width),
                       static_cast<int>(patch / width));
      gate.advance(1);
    });
    for (PyramidPatch& patch : level.patches) patch.bound = patch.error;
    if (n > 0) terrain::takeBounds(level, pyramid.levels[n - 1]);
  }
  report(options.progress, 1);
  return pyramid;
}

}  // namespace levelset
