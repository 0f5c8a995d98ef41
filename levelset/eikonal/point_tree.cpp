#include "levelset/eikonal/point_tree.h"

#include <algorithm>
#include <numeric>

namespace levelset::eikonal {

using openvdb::Vec3d;

PointTree::PointTree(std::span<const Vec3d> points)
    : points_(points), order_(points.size()), axes_(points.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  build(0, order_.size());
}

void PointTree::build(std::size_t begin, std::size_t end) {
  if (end - begin < 2) return;
  Vec3d low = points_[order_[begin]], high = low;
  for (std::size_t i = begin; i < end; ++i) {
    low = openvdb::math::minComponent(low, points_[order_[i]]);
    high = openvdb::math::maxComponent(high, points_[order_[i]]);
  }
  const Vec3d size = high - low;
  const int axis = size[0] >= size[1] && size[0] >= size[2] ? 0 : size[1] >= size[2] ? 1 : 2;
  const std::size_t middle = begin + (end - begin) / 2;
  const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
    const double pa = points_[a][axis], pb = points_[b][axis];
    return pa < pb || (pa == pb && a < b);
  });
  axes_[middle] = static_cast<std::uint8_t>(axis);
  build(begin, middle);
  build(middle + 1, end);
}

struct PointTree::Search {
  const PointTree& tree;
  Vec3d query;
  double squared;
  std::uint32_t best = kNone;

  void visit(std::size_t begin, std::size_t end) {
    if (begin == end) return;
    const std::size_t middle = begin + (end - begin) / 2;
    const std::uint32_t point = tree.order_[middle];
    const Vec3d offset = query - tree.points_[point];
    const double distance = offset.lengthSqr();
    if (distance < squared || (distance == squared && point < best && best != kNone)) {
      squared = distance;
      best = point;
    }
    const double along = offset[tree.axes_[middle]];
    const bool left = along < 0;
    left ? visit(begin, middle) : visit(middle + 1, end);
    if (along * along <= squared) left ? visit(middle + 1, end) : visit(begin, middle);
  }
};

std::uint32_t PointTree::nearest(const Vec3d& query, double limit) const {
  Search search{*this, query, limit * limit};
  search.visit(0, order_.size());
  return search.best;
}

}  // namespace levelset::eikonal
