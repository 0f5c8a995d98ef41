#include "levelset/terrain/height_pyramid.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/progress_gate.h"
#include "levelset/terrain/pyramid_parts.h"

namespace levelset {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

/// Height of the ground at a point. Coordinates count samples.
double heightOnEdge(const HeightField& field, double x, double y) {
  const int column = std::min(static_cast<int>(x), field.columns - 2),
            row = std::min(static_cast<int>(y), field.rows - 2);
  const double u = x - column, v = y - row;
  const auto at = [&](int c, int r) { return static_cast<double>(field.at(c, r)); };
  const double low = at(column, row), high = at(column + 1, row + 1);
  // Below the diagonal of the cell, the triangle has its right angle at the corner along x.
  const double corner = u >= v ? at(column + 1, row) : at(column, row + 1);
  const double first = std::max(u, v), second = std::min(u, v);
  return low + (corner - low) * first + (high - corner) * second;
}

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
      const float height = field.at(i, j) + 0.0F;  // zeros become positive
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
  patch.error = terrain::heightRoundedUp(error);
  return patch;
}

/// Raises the bounds of a level to those of the finer level.
void takeBounds(PyramidLevel& level, const PyramidLevel& finer) {
  for (int row = 0; row < finer.rows; ++row)
    for (int column = 0; column < finer.columns; ++column) {
      PyramidPatch& parent =
          level
              .patches[static_cast<std::size_t>(row / 2) * static_cast<std::size_t>(level.columns) +
                       static_cast<std::size_t>(column / 2)];
      parent.bound = std::max(parent.bound, finer.at(column, row).bound);
    }
}

}  // namespace

double coarseCellError(const HeightField& field, int firstColumn, int firstRow, int lastColumn,
                       int lastRow) {
  const double width = lastColumn - firstColumn, height = lastRow - firstRow;
  const auto at = [&](int c, int r) { return static_cast<double>(field.at(c, r)); };
  const double low = at(firstColumn, firstRow), high = at(lastColumn, lastRow),
               alongX = at(lastColumn, firstRow), alongY = at(firstColumn, lastRow);
  /// Height of the coarse triangles at a share of the rectangle's sides.
  const auto coarse = [&](double u, double v) {
    return u >= v ? low + (alongX - low) * u + (high - alongX) * v
                  : low + (alongY - low) * v + (high - alongY) * u;
  };
  double error = 0, magnitude = 0;
  for (int row = firstRow; row <= lastRow; ++row)
    for (int column = firstColumn; column <= lastColumn; ++column) {
      const double fine = at(column, row);
      if (std::isnan(fine)) return kUnbounded;
      error = std::max(error, std::abs(fine - coarse((column - firstColumn) / width,
                                                     (row - firstRow) / height)));
      magnitude = std::max(magnitude, std::abs(fine));
    }
  if (width == height && std::has_single_bit(static_cast<unsigned>(lastColumn - firstColumn)))
    return error;  // the diagonal runs along those of the cells, and nothing was rounded
  const auto compareAt = [&](double share) {
    if (!(share > 0 && share < 1)) return;
    const double fine = heightOnEdge(field, firstColumn + share * width, firstRow + share * height);
    error = std::max(error, std::abs(fine - (low + (high - low) * share)));
  };
  // The diagonal crosses lines between columns, between rows, and diagonals of cells.
  for (int n = 1; n < lastColumn - firstColumn; ++n) compareAt(n / width);
  for (int n = 1; n < lastRow - firstRow; ++n) compareAt(n / height);
  for (int n = std::min(0, lastColumn - firstColumn - (lastRow - firstRow));
       n <= std::max(0, lastColumn - firstColumn - (lastRow - firstRow)); ++n)
    if (n != 0) compareAt(n / (width - height));
  constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
  return error + kRounding * magnitude;
}

namespace terrain {

float heightRoundedUp(double height) {
  const auto rounded = static_cast<float>(height);
  return static_cast<double>(rounded) < height
             ? std::nextafter(rounded, std::numeric_limits<float>::infinity())
             : rounded;
}

HeightPyramid unmeasuredPyramid(int columns, int rows, int cells, std::size_t maxMemory) {
  if (cells < 2 || cells > 128 || !std::has_single_bit(static_cast<unsigned>(cells)))
    throw UsageError(
        fmt::format("the patches of a pyramid have {} cells a side; give a power of two from 2 to "
                    "128",
                    cells));
  if (columns < 2 || rows < 2)
    throw InvalidInput(
        fmt::format("the terrain has {}x{} samples, but a pyramid needs at least "
                    "2x2; give more",
                    columns, rows));
  HeightPyramid pyramid{.cells = cells, .levels = {}};
  const auto patchesAt = [&](int samples, int level) {
    const std::int64_t side = std::int64_t{cells} << level;
    return static_cast<int>((samples - 1 + side - 1) / side);
  };
  // Each level has a quarter of the patches of the one before.
  requireMemory(4.0 / 3 * sizeof(PyramidPatch) * patchesAt(columns, 0) * patchesAt(rows, 0),
                memoryLeft(memoryLimit(maxMemory)));
  for (int level = 0;; ++level) {
    PyramidLevel next{
        .columns = patchesAt(columns, level), .rows = patchesAt(rows, level), .patches = {}};
    next.patches.resize(static_cast<std::size_t>(next.columns) *
                        static_cast<std::size_t>(next.rows));
    pyramid.levels.push_back(std::move(next));
    if (pyramid.levels.back().patches.size() == 1) return pyramid;
  }
}

}  // namespace terrain

HeightPyramid heightPyramid(const HeightField& field, const PyramidOptions& options) {
  requireHeights(field);
  HeightPyramid pyramid =
      terrain::unmeasuredPyramid(field.columns, field.rows, options.cells, options.maxMemory);
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
    if (n > 0) takeBounds(level, pyramid.levels[n - 1]);
  }
  report(options.progress, 1);
  return pyramid;
}

}  // namespace levelset
