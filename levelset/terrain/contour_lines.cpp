#include "levelset/terrain/contour_lines.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/mix_hash.h"
#include "levelset/terrain/ground_triangles.h"

namespace levelset {
namespace {

/// Rows of cells whose pieces are found at once, by several threads.
constexpr int kRowsAtOnce = 16;

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

  /// Largest number of pieces in a row of cells.
  [[nodiscard]] std::size_t mostPieces(int row) const {
    std::size_t count = 0;
    for (int column = 0; column + 1 < field_.columns; ++column) {
      const terrain::GroundCell cell(field_, column, row);
      if (!cell.isComplete()) continue;
      const auto [least, most] =
          std::minmax({cell.lowLow, cell.highLow, cell.lowHigh, cell.highHigh});
      const auto from = std::upper_bound(heights_.begin(), heights_.end(), least);
      // A cell has at most two pieces of a height.
      count += 2 * static_cast<std::size_t>(std::upper_bound(from, heights_.end(), most) - from);
    }
    return count;
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

/// A line that grows at both ends.
struct GrowingLine {
  std::size_t level = 0;
  ContourEdge from = 0, to = 0;                   // edges of its ends
  bool isBeginFinal = false, isEndFinal = false;  // no later piece continues it there
  std::vector<Imath::V2d> front, back;            // points: `front` from its last one, then `back`

  [[nodiscard]] std::size_t size() const { return front.size() + back.size(); }
  /// @return true if the point is not the last one already
  bool append(const Imath::V2d& point) {
    const Imath::V2d* last = !back.empty() ? &back.back() : front.empty() ? nullptr : &front[0];
    if (last && *last == point) return false;
    back.push_back(point);
    return true;
  }
  bool prepend(const Imath::V2d& point) {
    const Imath::V2d* first = !front.empty() ? &front.back() : back.empty() ? nullptr : &back[0];
    if (first && *first == point) return false;
    front.push_back(point);
    return true;
  }
  /// Takes the points of a line that begins at the last point of this one.
  void appendLine(const GrowingLine& next) {
    for (auto point = next.front.rbegin(); point != next.front.rend(); ++point) append(*point);
    for (const Imath::V2d& point : next.back) append(point);
  }
  /// Takes the points of a line that ends at the first point of this one.
  void prependLine(const GrowingLine& previous) {
    for (auto point = previous.back.rbegin(); point != previous.back.rend(); ++point)
      prepend(*point);
    for (const Imath::V2d& point : previous.front) prepend(point);
  }
};

/// Joins pieces to lines while it passes from row to row. A line is complete when none of its ends
/// can continue in a later row.
class LineJoiner {
 public:
  LineJoiner(const ContourCells& cells, const HeightField& field,
             const std::vector<double>& heights)
      : cells_(cells), heights_(heights), width_(static_cast<std::size_t>(field.columns)) {}

  /// Adds a piece of a row of cells, after all pieces of the rows below.
  void add(const ContourPiece& piece, int row) {
    const std::size_t before = take(endsAt(piece.from, row), piece.from, piece.level),
                      after = take(beginsAt(piece.to, row), piece.to, piece.level);
    if (before != kNoLine && before == after) return complete(before, true);
    const double height = heights_[piece.level];
    std::size_t line = 0;
    if (before != kNoLine && after != kNoLine) {
      line = join(before, after, row);
      if (lines_[line].isBeginFinal && lines_[line].isEndFinal) complete(line, false);
    } else if (before != kNoLine) {
      line = before;
      points_ += lines_[line].append(cells_.crossing(piece.to, height));
    } else if (after != kNoLine) {
      line = after;
      points_ += lines_[line].prepend(cells_.crossing(piece.from, height));
    } else {
      line = newLine(piece.level);
      points_ += lines_[line].append(cells_.crossing(piece.from, height));
      points_ += lines_[line].append(cells_.crossing(piece.to, height));
    }
    if (before == kNoLine) {
      lines_[line].from = piece.from;
      beginsAt(piece.from, row)[{piece.from, piece.level}] = line;
    }
    if (after == kNoLine) {
      lines_[line].to = piece.to;
      endsAt(piece.to, row)[{piece.to, piece.level}] = line;
    }
  }

  /// Ends a row: only the ends at its upper edges may continue.
  void endRow() {
    for (const auto& [at, line] : begins_[0]) lines_[line].isBeginFinal = true;
    for (const auto& [at, line] : ends_[0]) lines_[line].isEndFinal = true;
    for (const auto* ends : {&begins_[0], &ends_[0]})
      for (const auto& [at, line] : *ends)
        if (lines_[line].isBeginFinal && lines_[line].isEndFinal && lines_[line].size() > 0)
          complete(line, false);
    begins_[0].clear();
    ends_[0].clear();
    std::swap(begins_[0], begins_[1]);
    std::swap(ends_[0], ends_[1]);
  }

  /// Passes the complete lines on, in an order that depends on the heights only.
  template <typename Sink>
  void passOn(const Sink& sink) {
    std::sort(complete_.begin(), complete_.end(),
              [](const auto& a, const auto& b) { return a.first < b.first; });
    for (auto& [number, line] : complete_) sink(std::move(line));
    complete_.clear();
  }

  /// Memory of the lines that are not passed on, bytes.
  [[nodiscard]] double memoryUse() const {
    // Vectors grow by a half or more, and an entry of a map takes about 64 bytes.
    return 2.0 * sizeof(Imath::V2d) * static_cast<double>(points_) +
           64.0 * static_cast<double>(begins_[0].size() + begins_[1].size() + ends_[0].size() +
                                      ends_[1].size()) +
           static_cast<double>(lines_.size() * sizeof(GrowingLine));
  }

 private:
  static constexpr std::size_t kNoLine = std::numeric_limits<std::size_t>::max();
  struct End {
    ContourEdge edge;
    std::size_t level;
    bool operator==(const End&) const = default;
  };
  struct HashEnd {
    std::size_t operator()(const End& end) const { return mixHash(end.edge, end.level); }
  };
  using Ends = std::unordered_map<End, std::size_t, HashEnd>;

  /// 1 for the upper edges of a row of cells, which the next row has, too; 0 for its other edges.
  [[nodiscard]] std::size_t groupOf(ContourEdge edge, int row) const {
    return edge % 2 == 0 && edge / 2 >= (static_cast<std::size_t>(row) + 1) * width_;
  }
  Ends& beginsAt(ContourEdge edge, int row) { return begins_[groupOf(edge, row)]; }
  Ends& endsAt(ContourEdge edge, int row) { return ends_[groupOf(edge, row)]; }

  static std::size_t take(Ends& ends, ContourEdge edge, std::size_t level) {
    const auto found = ends.find({edge, level});
    if (found == ends.end()) return kNoLine;
    const std::size_t line = found->second;
    ends.erase(found);
    return line;
  }

  std::size_t newLine(std::size_t level) {
    std::size_t line = lines_.size();
    if (unused_.empty()) {
      lines_.emplace_back();
      numbers_.push_back(0);
    } else {
      line = unused_.back();
      unused_.pop_back();
    }
    lines_[line].level = level;
    numbers_[line] = count_++;
    return line;
  }

  void drop(std::size_t line) {
    lines_[line] = GrowingLine();
    unused_.push_back(line);
  }

  /// Joins two lines: the end of the first one is the begin of the second one. The shorter one is
  /// copied, so that a point moves at most log n times.
  std::size_t join(std::size_t first, std::size_t second, int row) {
    GrowingLine &a = lines_[first], &b = lines_[second];
    points_ -= a.size() + b.size();
    if (a.size() >= b.size()) {
      a.appendLine(b);
      points_ += a.size();
      a.to = b.to;
      a.isEndFinal = b.isEndFinal;
      if (!a.isEndFinal) endsAt(a.to, row)[{a.to, a.level}] = first;
      drop(second);
      return first;
    }
    b.prependLine(a);
    points_ += b.size();
    b.from = a.from;
    b.isBeginFinal = a.isBeginFinal;
    if (!b.isBeginFinal) beginsAt(b.from, row)[{b.from, b.level}] = second;
    drop(first);
    return second;
  }

  void complete(std::size_t n, bool isClosed) {
    GrowingLine& line = lines_[n];
    points_ -= line.size();
    ContourLine whole{.height = heights_[line.level], .isClosed = isClosed};
    whole.points.reserve(line.size());
    whole.points.assign(line.front.rbegin(), line.front.rend());
    whole.points.insert(whole.points.end(), line.back.begin(), line.back.end());
    while (isClosed && whole.points.size() > 1 && whole.points.back() == whole.points.front())
      whole.points.pop_back();
    if (whole.points.size() > 1) complete_.emplace_back(numbers_[n], std::move(whole));
    drop(n);
  }

  const ContourCells& cells_;
  const std::vector<double>& heights_;
  std::size_t width_;
  std::vector<GrowingLine> lines_;
  std::vector<std::size_t> numbers_, unused_;
  std::size_t count_ = 0, points_ = 0;
  std::array<Ends, 2> begins_, ends_;  // by groupOf()
  std::vector<std::pair<std::size_t, ContourLine>> complete_;
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

void forEachContourLine(const HeightField& field, const std::vector<double>& heights,
                        const std::function<void(ContourLine)>& take,
                        const ContourOptions& options) {
  requireHeights(field);
  for (std::size_t n = 0; n < heights.size(); ++n)
    if (!std::isfinite(heights[n]) || (n > 0 && heights[n] <= heights[n - 1]))
      throw UsageError(fmt::format(
          "height number {} of the contour lines, {}, is not larger than the one before "
          "it; give finite heights in ascending order",
          n + 1, heights[n]));
  const ContourCells cells(field, heights);
  LineJoiner joiner(cells, field, heights);
  const std::size_t left = memoryLeft(memoryLimit(options.maxMemory));
  const int rows = field.rows - 1;
  std::vector<std::vector<ContourPiece>> pieces(kRowsAtOnce);
  for (int first = 0; first < rows; first += kRowsAtOnce) {
    const int count = std::min(kRowsAtOnce, rows - first);
    std::atomic<std::size_t> most = 0;
    tbb::parallel_for(0, count, [&](int n) { most += cells.mostPieces(first + n); });
    requireMemory(joiner.memoryUse() + static_cast<double>(most) * sizeof(ContourPiece), left);
    tbb::parallel_for(0, count, [&](int n) {
      std::vector<ContourPiece>& found = pieces[static_cast<std::size_t>(n)];
      found.clear();
      cells.forRow(first + n, [&](const ContourPiece& piece) { found.push_back(piece); });
    });
    double pieceBytes = 0;
    for (int n = 0; n < count; ++n) {
      const std::vector<ContourPiece>& found = pieces[static_cast<std::size_t>(n)];
      pieceBytes += static_cast<double>(found.capacity() * sizeof(ContourPiece));
      for (const ContourPiece& piece : found) joiner.add(piece, first + n);
      joiner.endRow();
      joiner.passOn(take);
    }
    requireMemory(joiner.memoryUse() + pieceBytes, left);
    report(options.progress, static_cast<double>(first + count) / rows);
  }
  joiner.endRow();
  joiner.passOn(take);
  report(options.progress, 1);
}

std::vector<ContourLine> contourLines(const HeightField& field, const std::vector<double>& heights,
                                      const ContourOptions& options) {
  const std::size_t left = memoryLeft(memoryLimit(options.maxMemory));
  double bytes = 0;
  std::vector<ContourLine> lines;
  forEachContourLine(
      field, heights,
      [&](ContourLine line) {
        bytes +=
            2.0 * sizeof line + static_cast<double>(line.points.size() * sizeof line.points[0]);
        requireMemory(bytes, left);
        lines.push_back(std::move(line));
      },
      options);
  std::stable_sort(lines.begin(), lines.end(),
                   [](const ContourLine& a, const ContourLine& b) { return a.height < b.height; });
  return lines;
}

}  // namespace levelset
