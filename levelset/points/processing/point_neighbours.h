#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "levelset/geometry/search/point_search.h"

namespace levelset::points {

/// A point near another one: its number in the cloud, and its squared distance.
using Neighbour = FoundItem;

/// Greatest number of neighbours that operators search for. More of them are no neighbourhood, and
/// take memory and time.
inline constexpr int kMostNeighbours = 1000;

/// @throws UsageError for more than kMostNeighbours
void requireNeighbours(std::int64_t neighbours);

/// The different positions of a point cloud in a tree. Points at equal positions count once, by the
/// one of lowest number: many of them would fill all neighbourhoods. Results do not depend on the
/// structure of the tree: neighbours are sorted by distance, then by number.
class PointNeighbours {
 public:
  /// Builds the tree in parallel. Copies the positions.
  explicit PointNeighbours(std::span<const Imath::V3d> positions);

  /// Number of different positions.
  [[nodiscard]] std::size_t size() const { return tree_.size(); }
  [[nodiscard]] std::size_t duplicates() const { return count_ - tree_.size(); }
  /// Number of the n-th point in the order of the tree, n < size(). Points near each other in this
  /// order are near each other in space.
  [[nodiscard]] std::uint32_t at(std::size_t n) const { return tree_.items()[n].index; }
  [[nodiscard]] const Imath::V3d& positionAt(std::size_t n) const {
    return tree_.items()[n].position;
  }
  /// Lowest number of the points at the position of point `index`.
  [[nodiscard]] std::uint32_t first(std::uint32_t index) const {
    return first_.empty() ? index : first_[index];
  }

  /// Finds the `count` points nearest to `from`, including one at `from` itself.
  /// @param found  receives the points, nearest first; fewer if the cloud has fewer positions
  void nearest(const Imath::V3d& from, std::size_t count, std::vector<Neighbour>& found) const {
    tree_.closest(from, count, found);
  }

  /// Finds all points nearer to `from` than `radius`, sorted by number.
  void within(const Imath::V3d& from, double radius, std::vector<Neighbour>& found) const;

  /// Takes the tree out of a list that is not used any more. Its items have the numbers of their
  /// order in the tree.
  [[nodiscard]] PointSearch takeSearch() && {
    tree_.renumber();
    return std::move(tree_);
  }

  /// Estimated memory of the tree while it is built, bytes.
  [[nodiscard]] static double bytesFor(std::size_t points);

 private:
  PointSearch tree_;
  std::vector<std::uint32_t> first_;  ///< empty without duplicates
  std::size_t count_ = 0;
};

}  // namespace levelset::points
