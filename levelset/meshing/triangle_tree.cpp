#include "levelset/meshing/triangle_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/closest_on_triangle.h"

namespace levelset {
namespace {

using openvdb::Vec3d;
using openvdb::Vec3f;

constexpr std::uint32_t kTrianglesPerLeaf = 4;

double squaredToBox(const Vec3f& low, const Vec3f& high, const Vec3d& p) {
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    const double out =
        std::max({static_cast<double>(low[i]) - p[i], p[i] - static_cast<double>(high[i]), 0.0});
    sum += out * out;
  }
  return sum;
}

}  // namespace

TriangleTree::TriangleTree(std::vector<Triangle> triangles) : triangles_(std::move(triangles)) {
  if (!triangles_.empty()) build(0, static_cast<std::uint32_t>(triangles_.size()));
}

std::uint32_t TriangleTree::build(std::uint32_t begin, std::uint32_t end) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  Vec3d low(std::numeric_limits<double>::max()), high = -low;
  for (std::uint32_t i = begin; i < end; ++i)
    for (const Vec3d& p : triangles_[i]) {
      low = openvdb::math::minComponent(low, p);
      high = openvdb::math::maxComponent(high, p);
    }
  // Rounded outwards: a box must hold its triangles.
  for (int i = 0; i < 3; ++i) {
    nodes_[index].low[i] = std::nextafter(static_cast<float>(low[i]), -INFINITY);
    nodes_[index].high[i] = std::nextafter(static_cast<float>(high[i]), INFINITY);
  }
  nodes_[index].begin = begin;
  nodes_[index].end = end;
  if (end - begin <= kTrianglesPerLeaf) return index;
  const Vec3d size = high - low;
  const int axis = size[0] >= size[1] && size[0] >= size[2] ? 0 : size[1] >= size[2] ? 1 : 2;
  const std::uint32_t middle = begin + (end - begin) / 2;
  const auto at = [&](std::uint32_t i) { return triangles_.begin() + i; };
  std::nth_element(at(begin), at(middle), at(end), [axis](const Triangle& a, const Triangle& b) {
    return a[0][axis] + a[1][axis] + a[2][axis] < b[0][axis] + b[1][axis] + b[2][axis];
  });
  build(begin, middle);
  nodes_[index].right = build(middle, end);
  return index;
}

struct TriangleTree::Search {
  const TriangleTree& tree;
  Vec3d from;
  double squared;
  Hit hit = {};

  void visit(std::uint32_t index) {
    const Node& node = tree.nodes_[index];
    if (!node.right) {
      for (std::uint32_t i = node.begin; i < node.end; ++i) {
        const Vec3d point = closestOnTriangle(from, tree.triangles_[i][0], tree.triangles_[i][1],
                                              tree.triangles_[i][2])
                                .point;
        const double d = (point - from).lengthSqr();
        if (!(d < squared)) continue;
        squared = d;
        hit.point = point;
        hit.found = true;
      }
      return;
    }
    std::uint32_t near = index + 1, far = node.right;
    double first = box(near), second = box(far);
    if (second < first) {
      std::swap(near, far);
      std::swap(first, second);
    }
    if (first < squared) visit(near);
    if (second < squared) visit(far);
  }
  [[nodiscard]] double box(std::uint32_t index) const {
    return squaredToBox(tree.nodes_[index].low, tree.nodes_[index].high, from);
  }
};

TriangleTree::Hit TriangleTree::nearest(const Vec3d& from, double limit) const {
  if (isEmpty()) return {};
  Search search{*this, from, limit * limit};
  search.visit(0);
  search.hit.distance = std::sqrt(search.squared);
  return search.hit;
}

}  // namespace levelset
