#include "levelset/rbf/sums/cluster_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>
#include <utility>

namespace levelset::rbf {

using Imath::Box3d;
using Imath::V3d;

double squaredGap(const Box3d& a, const Box3d& b) {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double gap = std::max({a.min[axis] - b.max[axis], b.min[axis] - a.max[axis], 0.0});
    sum += gap * gap;
  }
  return sum;
}

ClusterTree::ClusterTree(std::span<const V3d> points, std::size_t leafSize)
    : points_(points), order_(points.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  nodes_.push_back({.begin = 0, .end = static_cast<std::uint32_t>(points.size())});
  for (std::size_t node = 0; node < nodes_.size(); ++node) split(node, leafSize);
}

void ClusterTree::split(std::size_t at, std::size_t leafSize) {
  const std::uint32_t begin = nodes_[at].begin, end = nodes_[at].end;
  Box3d box;
  for (std::uint32_t n = begin; n < end; ++n) box.extendBy(points_[order_[n]]);
  nodes_[at].box = box;
  if (end - begin <= leafSize) return;
  const auto axis = static_cast<int>(box.majorAxis());
  const std::uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](std::uint32_t a, std::uint32_t b) {
                     return std::pair(points_[a][axis], a) < std::pair(points_[b][axis], b);
                   });
  nodes_[at].child = static_cast<std::int32_t>(nodes_.size());
  nodes_.push_back({.begin = begin, .end = middle});
  nodes_.push_back({.begin = middle, .end = end});
}

ClusterTree ClusterTree::inOrder(std::span<const V3d> orderedPoints) const {
  ClusterTree result = *this;
  result.points_ = orderedPoints;
  std::iota(result.order_.begin(), result.order_.end(), 0u);
  return result;
}

std::uint32_t ClusterTree::nearest(std::uint32_t point) const {
  const V3d p = points_[point];
  const Box3d place(p, p);
  std::pair best(std::numeric_limits<double>::infinity(), point);
  std::vector<std::int32_t> open = {0};
  while (!open.empty()) {
    const Node& node = nodes_[static_cast<std::size_t>(open.back())];
    open.pop_back();
    if (squaredGap(node.box, place) > best.first) continue;
    if (node.isLeaf()) {
      for (std::uint32_t n = node.begin; n < node.end; ++n)
        if (order_[n] != point)
          best = std::min(best, std::pair((points_[order_[n]] - p).length2(), order_[n]));
      continue;
    }
    // The nearer child is pushed last, so that it is visited first.
    const auto first = static_cast<std::size_t>(node.child);
    const bool isFirstNearer =
        squaredGap(nodes_[first].box, place) <= squaredGap(nodes_[first + 1].box, place);
    open.push_back(isFirstNearer ? node.child + 1 : node.child);
    open.push_back(isFirstNearer ? node.child : node.child + 1);
  }
  return best.second;
}

std::vector<std::uint32_t> ClusterTree::within(const V3d& center, double radius) const {
  const Box3d place(center, center);
  const double squared = radius * radius;
  std::vector<std::uint32_t> found;
  std::vector<std::int32_t> open = {0};
  while (!open.empty()) {
    const Node& node = nodes_[static_cast<std::size_t>(open.back())];
    open.pop_back();
    if (squaredGap(node.box, place) > squared) continue;
    if (node.isLeaf()) {
      for (std::uint32_t n = node.begin; n < node.end; ++n)
        if ((points_[order_[n]] - center).length2() <= squared) found.push_back(order_[n]);
    } else {
      open.push_back(node.child + 1);
      open.push_back(node.child);
    }
  }
  return found;
}

std::vector<std::uint32_t> ClusterTree::around(const Box3d& box, std::size_t count) const {
  using Far = std::pair<double, std::uint32_t>;
  std::vector<Far> found;
  std::priority_queue<Far, std::vector<Far>, std::greater<>> open;  // nodes, ordered by distance
  open.emplace(squaredGap(nodes_[0].box, box), 0);
  // Squared distance of the farthest of the `count` nearest points found so far; infinite until
  // there are `count` points. Nodes beyond it cannot contain a nearer point.
  double reach = std::numeric_limits<double>::infinity();
  while (!open.empty() && open.top().first <= reach) {
    const Node& node = nodes_[open.top().second];
    open.pop();
    if (!node.isLeaf()) {
      for (std::uint32_t n = 0; n < 2; ++n) {
        const auto child = static_cast<std::uint32_t>(node.child) + n;
        open.emplace(squaredGap(nodes_[child].box, box), child);
      }
      continue;
    }
    for (std::uint32_t n = node.begin; n < node.end; ++n) {
      const V3d& p = points_[order_[n]];
      found.emplace_back(squaredGap(Box3d(p, p), box), order_[n]);
    }
    if (found.size() < count) continue;
    const auto last = found.begin() + static_cast<std::ptrdiff_t>(count) - 1;
    std::nth_element(found.begin(), last, found.end());
    reach = last->first;
  }
  std::sort(found.begin(), found.end());
  found.resize(std::min(found.size(), count));
  std::vector<std::uint32_t> result;
  for (const Far& f : found) result.push_back(f.second);
  return result;
}

}  // namespace levelset::rbf
