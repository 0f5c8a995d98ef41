#include "levelset/terrain/contour_lines.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/progress_gate.h"
#include "levelset/terrain/ground_triangles.h"

namespace levelset {
namespace {

/// An edge of the grid: twice the index of its sample of least x and y, plus 1 for an edge along y.
using ContourEdge = std::uint64_t;

/// A piece of a line in a cell, from one edge of the cell to another.
struct ContourPiece {
  std::size_t level;
  ContourEdge from, to;
};

/// Finds the pieces in the cells of one height field.
class ContourCells {
 public:
  ContourCells(const HeightField& field, const std::vector<double>& heights)
      : field_(field), heights_(heights) {}

  /// Calls `take(piece)` for all pieces in a row of cells.
  template <typename Take>
  void forRow(int row, const Take& take) const {
    for (int column = 0; column + 1 < field_.columns; ++column) {
      const terrain::GroundCell cell(field_, column, row);
      if (!cell.isComplete()) continue;
      const auto [least, most] =
          std::minmax({cell.lowLow, cell.highLow, cell.lowHigh, cell.highHigh});
      // A height crosses the cell if some corner is below it and another one is not.
      auto level = std::upper_bound(heights_.begin(), heights_.end(), least);
      for (; level != heights_.end() && *level <= most; ++level)
        addPieces(cell, column, row, static_cast<std::size_t>(level - heights_.begin()), take);
    }
  }

  /// Position of the line on an edge.
  [[nodiscard]] Imath::V2d crossing(ContourEdge edge, double height) const {
    const std::size_t sample = edge / 2;
    const auto width = static_cast<std::size_t>(field_.columns);
    const int column = static_cast<int>(sample % width), row = static_cast<int>(sample / width);
    const bool isAlongY = edge % 2;
    const double from = static_cast<double>(field_.heights[sample]),
                 to = static_cast<double>(field_.heights[sample + (isAlongY ? width : 1)]);
    const double share = (height - from) / (to - from);
    const Imath::V2d begin = field_.position(column, row);
    const Imath::V2d end =
        isAlongY ? field_.position(column, row + 1) : field_.position(column + 1, row);
    // Ends are met exactly, so that lines through a sample meet there.
    if (share <= 0) return begin;
    if (share >= 1) return end;
    return begin + (end - begin) * share;
  }

 private:
  template <typename Take>
  void addPieces(const terrain::GroundCell& cell, int column, int row, std::size_t level,
                 const Take& take) const {
    // Corners and edges counter-clockwise; edge n leads from corner n to corner n + 1.
    const std::array<double, 4> corners = {cell.lowLow, cell.highLow, cell.highHigh, cell.lowHigh};
    const double height = heights_[level];
    std::array<bool, 4> isHigh;
    for (std::size_t n = 0; n < 4; ++n) isHigh[n] = corners[n] >= height;
    const std::array<ContourEdge, 4> edges = {
        2 * field_.index(column, row), 2 * field_.index(column + 1, row) + 1,
        2 * field_.index(column, row + 1), 2 * field_.index(column, row) + 1};
    const auto falls = [&](std::size_t n) { return isHigh[n] && !isHigh[(n + 1) % 4]; };
    const auto rises = [&](std::size_t n) { return !isHigh[n] && isHigh[(n + 1) % 4]; };
    const bool isSaddle =
        isHigh[0] == isHigh[2] && isHigh[1] == isHigh[3] && isHigh[0] != isHigh[1];
    if (isSaddle) {
      const double saddle = (corners[0] * corners[2] - corners[1] * corners[3]) /
                            (corners[0] + corners[2] - corners[1] - corners[3]);
      // High ground that is connected lies on the left of pieces around the low corners.
      const std::size_t step = saddle >= height ? 1 : 3;
      for (std::size_t n = 0; n < 4; ++n)
        if (falls(n)) take(ContourPiece{level, edges[n], edges[(n + step) % 4]});
      return;
    }
    ContourPiece piece{level, 0, 0};
    for (std::size_t n = 0; n < 4; ++n) {
      if (falls(n)) piece.from = edges[n];
      if (rises(n)) piece.to = edges[n];
    }
    take(piece);
  }

  const HeightField& field_;
  const std::vector<double>& heights_;
};

/// Joins the pieces of one height to lines.
class LineJoiner {
 public:
  LineJoiner(const ContourCells& cells, double height, std::vector<ContourPiece> pieces)
      : cells_(cells), height_(height), pieces_(std::move(pieces)) {}

  std::vector<ContourLine> joined() {
    std::sort(pieces_.begin(), pieces_.end(),
              [](const ContourPiece& a, const ContourPiece& b) { return a.from < b.from; });
    used_.assign(pieces_.size(), 0);
    std::vector<char> isContinued(pieces_.size(), 0);  // another piece ends where this one begins
    for (const ContourPiece& piece : pieces_)
      if (const std::size_t next = find(piece.to); next < pieces_.size()) isContinued[next] = 1;
    std::vector<ContourLine> lines;
    for (std::size_t n = 0; n < pieces_.size(); ++n)
      if (!isContinued[n]) follow(n, false, lines);
    for (std::size_t n = 0; n < pieces_.size(); ++n)
      if (!used_[n]) follow(n, true, lines);
    return lines;
  }

 private:
  /// Index of the piece that begins at an edge; the number of pieces if there is none.
  [[nodiscard]] std::size_t find(ContourEdge edge) const {
    const auto found =
        std::lower_bound(pieces_.begin(), pieces_.end(), edge,
                         [](const ContourPiece& piece, ContourEdge at) { return piece.from < at; });
    return found != pieces_.end() && found->from == edge
               ? static_cast<std::size_t>(found - pieces_.begin())
               : pieces_.size();
  }

  void follow(std::size_t first, bool isClosed, std::vector<ContourLine>& lines) {
    ContourLine line{.height = height_, .isClosed = isClosed};
    const auto add = [&](ContourEdge edge) {
      const Imath::V2d point = cells_.crossing(edge, height_);
      if (line.points.empty() || line.points.back() != point) line.points.push_back(point);
    };
    add(pieces_[first].from);
    for (std::size_t n = first; n < pieces_.size() && !used_[n];) {
      used_[n] = 1;
      add(pieces_[n].to);
      n = find(pieces_[n].to);
    }
    while (isClosed && line.points.size() > 1 && line.points.back() == line.points.front())
      line.points.pop_back();
    if (line.points.size() > 1) lines.push_back(std::move(line));
  }

  const ContourCells& cells_;
  double height_;
  std::vector<ContourPiece> pieces_;
  std::vector<char> used_;
};

}  // namespace

std::vector<double> contourHeights(const HeightField& field, double interval, double base) {
  if (!(interval > 0 && std::isfinite(interval)) || !std::isfinite(base))
    throw UsageError(fmt::format(
        "the interval of the contour lines is {} from {}; give a positive interval and a finite "
        "base",
        interval, base));
  const Imath::Box3d bounds = field.bounds();
  if (bounds.isEmpty()) return {};
  const double first = std::ceil((bounds.min.z - base) / interval),
               last = std::floor((bounds.max.z - base) / interval);
  constexpr double kMostHeights = 100'000;
  if (!(last - first < kMostHeights))
    throw UsageError(
        fmt::format("an interval of {} gives {:.0f} heights between {:.6g} and {:.6g}, more than "
                    "the limit of {:.0f}; give a larger interval",
                    interval, last - first + 1, bounds.min.z, bounds.max.z, kMostHeights));
  constexpr double kMostIntervals = 1e15;  // whole numbers that a double can count by one
  if (!(std::max(std::abs(first), std::abs(last)) < kMostIntervals))
    throw UsageError(fmt::format(
        "an interval of {} is too small for heights from {:.6g} to {:.6g} with the base "
        "{}; give a larger interval, or a base near the heights",
        interval, bounds.min.z, bounds.max.z, base));
  std::vector<double> heights;
  for (double n = first; n <= last; ++n) heights.push_back(base + n * interval);
  return heights;
}

std::vector<ContourLine> contourLines(const HeightField& field, const std::vector<double>& heights,
                                      const ContourOptions& options) {
  requireHeights(field);
  for (std::size_t n = 0; n < heights.size(); ++n)
    if (!std::isfinite(heights[n]) || (n > 0 && heights[n] <= heights[n - 1]))
      throw UsageError(fmt::format(
          "height number {} of the contour lines, {}, is not larger than the one before "
          "it; give finite heights in ascending order",
          n + 1, heights[n]));
  const ContourCells cells(field, heights);
  const int rows = std::max(0, field.rows - 1);
  std::vector<std::size_t> counts(static_cast<std::size_t>(rows), 0);
  tbb::parallel_for(0, rows, [&](int row) {
    cells.forRow(row, [&](const ContourPiece&) { ++counts[static_cast<std::size_t>(row)]; });
  });
  std::size_t total = 0;
  for (const std::size_t count : counts) total += count;
  // Each piece is held twice, and its point in the line and its growth take 32 bytes.
  requireMemory(static_cast<double>(total) * (2.0 * sizeof(ContourPiece) + 32),
                memoryLeft(memoryLimit(options.maxMemory)));
  report(options.progress, 0.2);

  std::vector<std::vector<ContourPiece>> byRow(static_cast<std::size_t>(rows));
  tbb::parallel_for(0, rows, [&](int row) {
    std::vector<ContourPiece>& pieces = byRow[static_cast<std::size_t>(row)];
    pieces.reserve(counts[static_cast<std::size_t>(row)]);
    cells.forRow(row, [&](const ContourPiece& piece) { pieces.push_back(piece); });
  });
  std::vector<std::vector<ContourPiece>> byHeight(heights.size());
  for (std::vector<ContourPiece>& pieces : byRow) {
    for (const ContourPiece& piece : pieces) byHeight[piece.level].push_back(piece);
    std::vector<ContourPiece>().swap(pieces);
  }
  report(options.progress, 0.5);

  std::vector<std::vector<ContourLine>> linesOf(heights.size());
  const Progress joining = subProgress(options.progress, 0.5, 1);
  ProgressGate gate(joining, heights.size());
  tbb::parallel_for(std::size_t{0}, heights.size(), [&](std::size_t n) {
    linesOf[n] = LineJoiner(cells, heights[n], std::move(byHeight[n])).joined();
    gate.advance(1);
  });
  std::vector<ContourLine> lines;
  for (std::vector<ContourLine>& some : linesOf)
    for (ContourLine& line : some) lines.push_back(std::move(line));
  report(options.progress, 1);
  return lines;
}

}  // namespace levelset
