#include "levelset/points/search/point_search.h"

namespace levelset::points {

template class OverlapTree<PointItem, SiblingBoxes>;

PointSearch makePointSearch(std::span<const Imath::V3d> positions) {
  std::vector<PointItem> items;
  items.reserve(positions.size());
  for (const Imath::V3d& p : positions)
    items.push_back({p, static_cast<std::uint32_t>(items.size())});
  return PointSearch(std::move(items));
}

}  // namespace levelset::points
