#pragma once

// Internal header of levelset/deform: public headers must not include it.

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <queue>
#include <utility>

#include "levelset/memory/memory_limit.h"

namespace levelset {

/// Branch and bound for the least value of polynomials on the pieces of a lattice. Parts are
/// halved, the one with the least bound first.
/// @tparam Part     polynomials on a part of a piece
/// @tparam Bracket  bounds of the least value on a part, with `low` and `high`
/// @tparam Bounds   has partOf(piece), boundsOf(part) and split(part)
template <typename Part, typename Bracket, typename Bounds>
class LeastValueSearch {
 public:
  explicit LeastValueSearch(const Bounds& bounds) : bounds_(bounds) {}

  /// Least upper bound, with its place.
  Bracket best;
  /// Least lower bound of the parts and pieces that are not halved any more.
  double settled = std::numeric_limits<double>::infinity();

  void offer(const Bracket& one) {
    if (one.high < best.high) best = one;
  }
  /// Adds a whole piece. Its polynomials are made when it is halved, so that the queue stays small.
  void add(const Bracket& bracket, std::size_t piece) {
    offer(bracket);
    queue_.push({bracket, piece, {}});
  }

  /// Halves parts until isDone(least bound of the queue), no part is left, or `mostBoxes` parts
  /// were made.
  /// @param report     called with the number of parts after each step
  /// @return number of parts that were made
  /// @throws ResourceLimit before the polynomials in the queue exceed `maxMemory`
  template <typename IsDone, typename Report>
  std::size_t run(std::size_t mostBoxes, std::size_t maxMemory, const IsDone& isDone,
                  const Report& report) {
    std::size_t boxes = 0;
    double bytes = 0;
    while (!queue_.empty() && boxes < mostBoxes) {
      const double low = queue_.top().bounds.low;
      if (low >= settled || isDone(low)) break;
      Entry top = queue_.top();
      queue_.pop();
      if (top.part)
        bytes -= bytesOf(*top.part);
      else
        top.part = bounds_.partOf(top.piece);
      for (Part& half : Bounds::split(std::move(*top.part))) {
        Entry next{Bounds::boundsOf(half), top.piece, std::move(half)};
        ++boxes;
        // The least value is not above best.high, so this part is never halved.
        if (next.bounds.low >= best.high) {
          settled = std::min(settled, next.bounds.low);
          continue;
        }
        offer(next.bounds);
        bytes += bytesOf(*next.part);
        queue_.push(std::move(next));
      }
      requireMemory(bytes, maxMemory);
      report(boxes);
    }
    return boxes;
  }

  /// Lower bound of the least value.
  [[nodiscard]] double low() const {
    return std::min(settled, queue_.empty() ? settled : queue_.top().bounds.low);
  }

 private:
  struct Entry {
    Bracket bounds;
    std::size_t piece = 0;
    std::optional<Part> part = {};

    bool operator<(const Entry& other) const {  // the least bound is on top
      return bounds.low != other.bounds.low ? bounds.low > other.bounds.low : piece > other.piece;
    }
  };

  const Bounds& bounds_;
  std::priority_queue<Entry> queue_;
};

}  // namespace levelset
