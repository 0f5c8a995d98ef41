#include "levelset/terrain/pyramid_parts.h"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "levelset/error.h"

namespace levelset::terrain {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

int patchesAlong(int samples, int cells, int level) {
  const std::int64_t side = std::int64_t{cells} << level;
  return static_cast<int>((samples - 1 + side - 1) / side);
}

/// Height of the ground in a cell of a window. @param u, v  place in the cell, 0 to 1
double heightInCell(const HeightField& window, int column, int row, double u, double v) {
  const auto at = [&](int c, int r) { return static_cast<double>(window.at(c, r)); };
  const double low = at(column, row), high = at(column + 1, row + 1);
  // Below the diagonal of the cell, the triangle has its right angle at the corner along x.
  const double corner = u >= v ? at(column + 1, row) : at(column, row + 1);
  const double first = std::max(u, v), second = std::min(u, v);
  return low + (corner - low) * first + (high - corner) * second;
}

}  // namespace

void requirePyramid(int columns, int rows, int cells) {
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
}

double patchCount(int columns, int rows, int cells) {
  double count = 0;
  for (int level = 0;; ++level) {
    const double patches =
        static_cast<double>(patchesAlong(columns, cells, level)) * patchesAlong(rows, cells, level);
    count += patches;
    if (patches == 1) return count;
  }
}

HeightPyramid emptyPyramid(int columns, int rows, int cells) {
  HeightPyramid pyramid{.cells = cells, .levels = {}};
  for (int level = 0;; ++level) {
    PyramidLevel next{.columns = patchesAlong(columns, cells, level),
                      .rows = patchesAlong(rows, cells, level),
                      .patches = {}};
    next.patches.resize(static_cast<std::size_t>(next.columns) *
                        static_cast<std::size_t>(next.rows));
    pyramid.levels.push_back(std::move(next));
    if (pyramid.levels.back().patches.size() == 1) return pyramid;
  }
}

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

void CoarseCell::Deviation::raiseTo(const Deviation& other) {
  error = std::max(error, other.error);
  magnitude = std::max(magnitude, other.magnitude);
}

CoarseCell::CoarseCell(int width, int height, const Corners& corners)
    : width_(width),
      height_(height),
      corners_(corners),
      isAligned_(width == height && std::has_single_bit(static_cast<unsigned>(width))) {}

void CoarseCell::compare(const HeightField& window, int column, int row,
                         Deviation& deviation) const {
  if (isAligned_) {
    compareSamples<true>(window, column, row, deviation);
  } else {
    compareSamples<false>(window, column, row, deviation);
    // Otherwise the diagonal runs along those of the cells, and nothing is rounded.
    if (deviation.error < kUnbounded) compareCrossings(window, column, row, deviation);
  }
}

template <bool kAligned>
void CoarseCell::compareSamples(const HeightField& window, int column, int row,
                                Deviation& deviation) const {
  const int firstColumn = std::max(0, column), firstRow = std::max(0, row);
  const int lastColumn = std::min(window.columns - 1, column + width_),
            lastRow = std::min(window.rows - 1, row + height_);
  const auto& [low, alongX, alongY, high] = corners_;
  const double width = width_, height = height_, inverse = 1 / width;
  double error = deviation.error, magnitude = deviation.magnitude;
  bool isMissing = false;
  for (int j = firstRow; j <= lastRow; ++j) {
    const float* heights = window.heights.data() + window.index(0, j);
    const double v = (j - row) / height;
    // The reciprocal of a power of two is exact.
    const auto shareAt = [&](int i) {
      return kAligned ? (i - column) * inverse : (i - column) / width;
    };
    const auto take = [&](int i, double coarse) {
      const double fine = heights[i];
      isMissing |= std::isnan(fine);
      error = std::max(error, std::abs(fine - coarse));
      if (!kAligned) magnitude = std::max(magnitude, std::abs(fine));
    };
    int i = firstColumn;
    const double atWest = low + (alongY - low) * v;
    for (double u; i <= lastColumn && (u = shareAt(i)) < v; ++i)
      take(i, atWest + (high - alongY) * u);
    const double rise = (high - alongX) * v;
    for (; i <= lastColumn; ++i) take(i, low + (alongX - low) * shareAt(i) + rise);
  }
  deviation = {.error = isMissing ? kUnbounded : error, .magnitude = magnitude};
}

/// Compares where the diagonal crosses lines between columns, between rows, and diagonals of cells.
void CoarseCell::compareCrossings(const HeightField& window, int column, int row,
                                  Deviation& deviation) const {
  const double width = width_, height = height_;
  const auto compareAt = [&](double share) {
    if (!(share > 0 && share < 1)) return;
    // Places count from the corner of the rectangle, so that their bits do not depend on windows.
    const double x = share * width, y = share * height;
    const int inX = std::min(static_cast<int>(x), width_ - 1),
              inY = std::min(static_cast<int>(y), height_ - 1);
    const int i = column + inX, j = row + inY;
    if (i < 0 || j < 0 || i >= window.columns - 1 || j >= window.rows - 1) return;
    const double fine = heightInCell(window, i, j, x - inX, y - inY);
    const double coarse = corners_.low + (corners_.high - corners_.low) * share;
    deviation.error = std::max(deviation.error, std::abs(fine - coarse));
  };
  // Shares at which the diagonal may be in the window, with a pad of one sample.
  const double low = std::max({0.0, (-1 - column) / width, (-1 - row) / height}),
               high =
                   std::min({1.0, (window.columns - column) / width, (window.rows - row) / height});
  if (low > high) return;
  const auto compareLines = [&](int count) {
    const int a = static_cast<int>(std::floor(low * count)),
              b = static_cast<int>(std::floor(high * count));
    for (int n = std::min(a, b); n <= std::max(a, b) + 1; ++n)
      if (n != 0) compareAt(n / static_cast<double>(count));
  };
  compareLines(width_);
  compareLines(height_);
  if (width_ != height_) compareLines(width_ - height_);
}

double CoarseCell::bound(const Deviation& deviation) const {
  constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
  return isAligned_ ? deviation.error : deviation.error + kRounding * deviation.magnitude;
}

}  // namespace levelset::terrain

namespace levelset {

float heightRoundedUp(double x) {
  const auto rounded = static_cast<float>(x);
  return static_cast<double>(rounded) < x
             ? std::nextafter(rounded, std::numeric_limits<float>::infinity())
             : rounded;
}

}  // namespace levelset
