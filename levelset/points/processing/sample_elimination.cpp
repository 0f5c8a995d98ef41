#include "levelset/points/processing/sample_elimination.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "levelset/points/processing/point_neighbours.h"
#include "levelset/progress_gate.h"

namespace levelset::points {
namespace {

using Imath::V3d;

// Number of a cell in the usual grid, from the lowest point on.
using NearCell = std::uint32_t;
// Number of a cell in a grid with far points, from the origin on. It is a whole number.
using FarCell = double;

constexpr double kMostNearCells = 4e9;
constexpr double kMostExactCell = 0x1p53;

/// Cell along an axis. Cells are a little longer than the radius, so rounding does not matter.
template <typename Cell>
Cell cellOf(double coordinate, double low, double edge);

template <>
NearCell cellOf<NearCell>(double coordinate, double low, double edge) {
  return static_cast<NearCell>((coordinate - low) / edge);
}

/// The number of the cell is exact below 2^53. Beyond it, two different coordinates are farther
/// apart than the radius, so points in other cells along this axis need no test.
template <>
FarCell cellOf<FarCell>(double coordinate, double, double edge) {
  const double cell = std::floor(coordinate / edge);
  const double rest = std::fma(-cell, edge, coordinate);
  return rest < 0 ? cell - 1 : rest >= edge ? cell + 1 : cell;
}

bool isOdd(NearCell cell) {
  return (cell & 1) != 0;
}
bool isOdd(FarCell cell) {
  return std::fmod(cell, 2) != 0;
}

/// Moves to a cell beside another one. Returns false if there is none to test.
bool shift(NearCell& cell, int by) {
  if (by < 0 && cell == 0) return false;
  cell += static_cast<NearCell>(by);
  return true;
}
bool shift(FarCell& cell, int by) {
  if (by != 0 && std::abs(cell) >= kMostExactCell) return false;
  cell += by;
  return true;
}

/// Cell of a grid, with one point in it.
template <typename Cell>
struct CellEntry {
  std::array<Cell, 3> cell;  // along z, y and x, so that a row along x is contiguous
  std::uint32_t index;
};

/// Range of entries in one cell. The chosen points of the cell are moved to its front.
template <typename Cell>
struct CellRange {
  std::array<Cell, 3> cell;
  std::uint32_t begin, end;
  std::uint32_t chosen = 0;
};

/// Colour of a cell. Two cells of one colour have a cell between them.
template <typename Cell>
unsigned colorOf(const std::array<Cell, 3>& cell) {
  return (isOdd(cell[0]) ? 1u : 0u) | (isOdd(cell[1]) ? 2u : 0u) | (isOdd(cell[2]) ? 4u : 0u);
}

/// Points in a grid of cells whose edges are at least as long as the radius.
template <typename Cell>
class DiskGrid {
 public:
  /// @param low  least coordinates of the points
  DiskGrid(const std::vector<V3d>& positions, double radius, double edge, const V3d& low)
      : positions_(positions),
        // Points at one position are near each other for any radius.
        squared_(std::max(radius * radius, std::numeric_limits<double>::denorm_min())) {
    entries_.resize(positions.size());
    tbb::parallel_for(std::size_t{0}, positions.size(), [&](std::size_t i) {
      Entry& entry = entries_[i];
      for (int axis = 0; axis < 3; ++axis)
        entry.cell[static_cast<std::size_t>(2 - axis)] =
            cellOf<Cell>(positions[i][axis], low[axis], edge);
      entry.index = static_cast<std::uint32_t>(i);
    });
    tbb::parallel_sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
      if (a.cell != b.cell) return a.cell < b.cell;
      const std::uint64_t first = mixed(0, a.index), second = mixed(0, b.index);
      return first != second ? first < second : a.index < b.index;
    });
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      const auto at = static_cast<std::uint32_t>(i);
      if (i == 0 || entries_[i].cell != entries_[i - 1].cell)
        cells_.push_back({entries_[i].cell, at, at});
      ++cells_.back().end;
    }
    for (std::size_t i = 0; i < cells_.size(); ++i)
      byColor_[colorOf(cells_[i].cell)].push_back(static_cast<std::uint32_t>(i));
  }

  std::vector<std::uint32_t> choose(const Progress& progress) {
    ProgressGate gate(progress, cells_.size());
    for (const std::vector<std::uint32_t>& cells : byColor_)
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, cells.size(), 256),
                        [&](const auto& range) {
                          for (std::size_t i = range.begin(); i < range.end(); ++i)
                            chooseIn(cells_[cells[i]]);
                          gate.advance(range.size());
                        });
    std::vector<std::uint32_t> chosen;
    for (const Range& range : cells_)
      for (std::uint32_t i = 0; i < range.chosen; ++i)
        chosen.push_back(entries_[range.begin + i].index);
    tbb::parallel_sort(chosen.begin(), chosen.end());
    return chosen;
  }

 private:
  using Entry = CellEntry<Cell>;
  using Range = CellRange<Cell>;

  [[nodiscard]] bool isNearChosen(const V3d& p, const Range& range) const {
    for (std::uint32_t i = range.begin; i < range.begin + range.chosen; ++i)
      if ((positions_[entries_[i].index] - p).length2() < squared_) return true;
    return false;
  }

  void chooseIn(Range& range) {
    std::array<const Range*, 26> near{};
    Cell first = range.cell[2], last = range.cell[2];
    shift(first, -1);
    shift(last, 1);
    std::size_t count = 0;
    for (int dz = -1; dz <= 1; ++dz)
      for (int dy = -1; dy <= 1; ++dy) {
        std::array<Cell, 3> from = range.cell;
        if (!shift(from[0], dz) || !shift(from[1], dy)) continue;
        from[2] = first;
        auto found = std::lower_bound(
            cells_.begin(), cells_.end(), from,
            [](const Range& a, const std::array<Cell, 3>& b) { return a.cell < b; });
        for (; found != cells_.end() && found->cell[0] == from[0] && found->cell[1] == from[1] &&
               found->cell[2] <= last;
             ++found)
          if (&*found != &range && found->chosen > 0) near[count++] = &*found;
      }
    for (std::uint32_t i = range.begin; i < range.end; ++i) {
      const V3d& p = positions_[entries_[i].index];
      bool isFree = !isNearChosen(p, range);
      for (std::size_t n = 0; n < count && isFree; ++n) isFree = !isNearChosen(p, *near[n]);
      if (isFree) std::swap(entries_[range.begin + range.chosen++], entries_[i]);
    }
  }

  const std::vector<V3d>& positions_;
  double squared_;
  std::vector<Entry> entries_;
  std::vector<Range> cells_;
  std::array<std::vector<std::uint32_t>, 8> byColor_;
};

/// Numbers of the first points at each position, ascending.
std::vector<std::uint32_t> differentPositions(const std::vector<V3d>& positions) {
  const PointNeighbours tree(positions);
  std::vector<std::uint32_t> numbers;
  numbers.reserve(tree.size());
  for (std::size_t n = 0; n < tree.size(); ++n) numbers.push_back(tree.at(n));
  tbb::parallel_sort(numbers.begin(), numbers.end());
  return numbers;
}

/// Adds the lowest other numbers until there are `count`.
/// @param numbers  ascending
/// @param all  number of points, at least `count`
std::vector<std::uint32_t> withDuplicates(std::vector<std::uint32_t> numbers, std::size_t all,
                                          std::size_t count) {
  std::vector<char> isChosen(all, 0);
  for (const std::uint32_t number : numbers) isChosen[number] = 1;
  for (std::uint32_t i = 0; i < all && numbers.size() < count; ++i)
    if (!isChosen[i]) numbers.push_back(i);
  tbb::parallel_sort(numbers.begin(), numbers.end());
  return numbers;
}

/// Weight by which a sample at a distance crowds another one.
class Crowding {
 public:
  Crowding(double greatest, double keptShare)
      : reach_(greatest), least_(greatest * kBeta * (1 - std::pow(keptShare, kGamma))) {}
  [[nodiscard]] double reach() const { return reach_; }
  [[nodiscard]] double operator()(double squared) const {
    const double share = 1 - std::max(std::sqrt(squared), least_) / reach_;
    if (!(share > 0)) return 0;
    const double second = share * share, fourth = second * second;
    return fourth * fourth;
  }

 private:
  static constexpr double kBeta = 0.65, kGamma = 1.5;  // values of [Yuksel15]
  double reach_, least_;
};

/// Binary heap of samples, with the greatest weight on top.
class SampleHeap {
 public:
  explicit SampleHeap(std::vector<double> weights)
      : weights_(std::move(weights)), heap_(weights_.size()), place_(weights_.size()) {
    for (std::size_t i = 0; i < heap_.size(); ++i)
      heap_[i] = place_[i] = static_cast<std::uint32_t>(i);
    for (std::size_t i = heap_.size() / 2; i-- > 0;) sink(i);
  }
  [[nodiscard]] std::size_t size() const { return heap_.size(); }
  std::uint32_t pop() {
    const std::uint32_t top = heap_[0];
    put(0, heap_.back());
    heap_.pop_back();
    place_[top] = kGone;
    if (!heap_.empty()) sink(0);
    return top;
  }
  void lower(std::uint32_t sample, double by) {
    if (place_[sample] == kGone) return;
    weights_[sample] -= by;
    sink(place_[sample]);
  }
  [[nodiscard]] const std::vector<std::uint32_t>& left() const { return heap_; }

 private:
  static constexpr std::uint32_t kGone = 0xffffffffu;
  void put(std::size_t at, std::uint32_t sample) {
    heap_[at] = sample;
    place_[sample] = static_cast<std::uint32_t>(at);
  }
  [[nodiscard]] bool isAbove(std::uint32_t a, std::uint32_t b) const {
    return weights_[a] != weights_[b] ? weights_[a] > weights_[b] : a < b;
  }
  void sink(std::size_t at) {
    const std::uint32_t sample = heap_[at];
    for (;;) {
      std::size_t child = 2 * at + 1;
      if (child >= heap_.size()) break;
      if (child + 1 < heap_.size() && isAbove(heap_[child + 1], heap_[child])) ++child;
      if (!isAbove(heap_[child], sample)) break;
      put(at, heap_[child]);
      at = child;
    }
    put(at, sample);
  }

  std::vector<double> weights_;
  std::vector<std::uint32_t> heap_, place_;
};

}  // namespace

std::vector<std::uint32_t> poissonDisk(const std::vector<V3d>& positions, double radius,
                                       const Progress& progress) {
  V3d low(std::numeric_limits<double>::infinity()), high = -low;
  for (const V3d& p : positions)
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  double extent = 0, farthest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    extent = std::max(extent, high[axis] - low[axis]);
    farthest = std::max({farthest, std::abs(low[axis]), std::abs(high[axis])});
  }
  // A cell is a little longer than the radius, since the number of a near cell is rounded.
  double edge = radius * 1.0001;
  if (extent <= kMostNearCells * edge)
    return DiskGrid<NearCell>(positions, radius, edge, low).choose(progress);
  constexpr double kMostFarCells = 1e300;
  edge = std::max(edge, farthest / kMostFarCells);
  return DiskGrid<FarCell>(positions, radius, edge, low).choose(progress);
}

std::vector<std::uint32_t> eliminateSamples(const std::vector<V3d>& positions, std::size_t count,
                                            double greatest, const Progress& progress) {
  // Few candidates lie within a fraction of the final distance, so a Poisson-disk sample of that
  // fraction loses no quality. It bounds the number of neighbours where the points are dense.
  constexpr double kCandidateShare = 0.25;
  constexpr double kLeastRadius = 1e-150;  // the squares of smaller numbers lose digits
  double radius = kCandidateShare * greatest;
  std::vector<std::uint32_t> candidates =
      poissonDisk(positions, radius, subProgress(progress, 0, 0.3));
  if (candidates.size() < count) {
    std::vector<std::uint32_t> different = differentPositions(positions);
    if (different.size() <= count)
      return withDuplicates(std::move(different), positions.size(), count);
    while (candidates.size() < count) {
      radius /= 2;
      report(progress, 0.3);
      candidates = radius > kLeastRadius ? poissonDisk(positions, radius, {}) : different;
    }
  }
  std::vector<V3d> places;
  places.reserve(candidates.size());
  for (const std::uint32_t candidate : candidates) places.push_back(positions[candidate]);
  const PointNeighbours tree(places);
  const Crowding crowding(std::min(greatest, radius / kCandidateShare),
                          static_cast<double>(count) / static_cast<double>(places.size()));
  std::vector<double> weights(places.size());
  const Progress searching = subProgress(progress, 0.3, 0.6);
  ProgressGate gate(searching, places.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, places.size(), 1024),
                    [&](const auto& range) {
                      std::vector<Neighbour> found;
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        tree.within(places[i], crowding.reach(), found);
                        for (const Neighbour& other : found)
                          if (other.index != i) weights[i] += crowding(other.squared);
                      }
                      gate.advance(range.size());
                    });
  SampleHeap heap(std::move(weights));
  std::vector<Neighbour> found;
  while (heap.size() > count) {
    const std::uint32_t removed = heap.pop();
    tree.within(places[removed], crowding.reach(), found);
    for (const Neighbour& other : found)
      if (other.index != removed) heap.lower(other.index, crowding(other.squared));
    if ((heap.size() & 0xFFF) == 0)
      report(progress, 0.6 + 0.4 * static_cast<double>(places.size() - heap.size()) /
                                 static_cast<double>(places.size() - count));
  }
  std::vector<std::uint32_t> left = heap.left();
  std::sort(left.begin(), left.end());
  for (std::uint32_t& sample : left) sample = candidates[sample];
  return left;
}

}  // namespace levelset::points
