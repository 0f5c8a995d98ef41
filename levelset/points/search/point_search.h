#pragma once

// For the .cpp files of this library only.

#include <span>

#include "levelset/points/search/overlap_tree.h"

namespace levelset::points {

/// Point with its number.
struct PointItem {
  static constexpr bool kHasExtent = false;
  Imath::V3d position;
  std::uint32_t index;

  [[nodiscard]] ItemBox box() const { return {position, position}; }
  [[nodiscard]] double squaredDistance(const Imath::V3d& from) const {
    const double x = position.x - from.x, y = position.y - from.y, z = position.z - from.z;
    return x * x + y * y + z * z;
  }
  [[nodiscard]] bool isSameAs(const PointItem& other) const { return position == other.position; }
};

/// Points in a tree, for searches of the closest ones. Any number of points may lie at one
/// position.
using PointSearch = OverlapTree<PointItem, SiblingBoxes>;
extern template class OverlapTree<PointItem, SiblingBoxes>;

/// Makes the tree of a list of points. Copies the positions.
/// @param positions  finite, fewer than 2²⁹
[[nodiscard]] PointSearch makePointSearch(std::span<const Imath::V3d> positions);

}  // namespace levelset::points
