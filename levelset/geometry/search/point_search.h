#pragma once

// For the .cpp files of this library only.

#include "levelset/geometry/search/overlap_tree.h"

namespace levelset {

/// Point with its number.
struct PointItem {
  using Number = double;
  static constexpr bool kHasExtent = false;
  Imath::V3d position;
  std::uint32_t index;

  [[nodiscard]] ItemBox<double> box() const { return {position, position}; }
  [[nodiscard]] double centre(int axis) const { return 2 * position[axis]; }
  [[nodiscard]] double squaredDistance(const Imath::V3d& from) const {
    const double x = position.x - from.x, y = position.y - from.y, z = position.z - from.z;
    return x * x + y * y + z * z;
  }
  [[nodiscard]] bool isSameAs(const PointItem& other) const { return position == other.position; }
};

/// Points in a tree, for searches of the closest ones. Any number of points may lie at one
/// position.
using PointSearch = OverlapTree<PointItem>;
extern template class OverlapTree<PointItem>;

/// Makes the tree of a list of points. Copies the positions.
/// @param positions  container of Imath or OpenVDB vectors: finite, fewer than 2²⁹
template <class Positions>
[[nodiscard]] PointSearch makePointSearch(const Positions& positions) {
  std::vector<PointItem> items;
  items.reserve(positions.size());
  for (const auto& p : positions)
    items.push_back({Imath::V3d(p[0], p[1], p[2]), static_cast<std::uint32_t>(items.size())});
  return PointSearch(std::move(items));
}

/// Returns true if a point is nearer to `from` than `distance`.
[[nodiscard]] inline bool isNear(const PointSearch& points, const Imath::V3d& from,
                                 double distance) {
  return points.closest(from, distance * distance).isValid();
}

}  // namespace levelset
