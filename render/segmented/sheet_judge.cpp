#include "render/segmented/sheet_judge.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "levelset/geometry/exact_predicates.h"

namespace render {
namespace {

using Imath::Box3d;
using Imath::V3d;

constexpr std::uint32_t kMostInLeaf = 4;

/// Returns true if a ray may meet a box. Boxes grow by far more than rounding.
bool mayMeet(const Box3d& box, const V3d& origin, const V3d& direction, double near, double far) {
  for (int axis = 0; axis < 3; ++axis) {
    const double scale =
        std::max({std::abs(box.min[axis]), std::abs(box.max[axis]), std::abs(origin[axis])});
    const double low = box.min[axis] - 1e-12 * scale - origin[axis],
                 high = box.max[axis] + 1e-12 * scale - origin[axis];
    if (direction[axis] == 0) {
      if (low > 0 || high < 0) return false;
      continue;
    }
    double a = low / direction[axis], b = high / direction[axis];
    if (a > b) std::swap(a, b);
    near = std::max(near, a - 1e-12 * std::abs(a));
    far = std::min(far, b + 1e-12 * std::abs(b));
  }
  return near <= far;
}

}  // namespace

SheetJudge::SheetJudge(std::shared_ptr<const SheetSurface> sheets, double voxelSize)
    : sheets_(std::move(sheets)), voxelSize_(voxelSize) {
  order_.resize(sheets_->triangles.size());
  std::iota(order_.begin(), order_.end(), 0u);
  build(0, static_cast<std::uint32_t>(order_.size()));
}

std::uint32_t SheetJudge::build(std::uint32_t first, std::uint32_t last) {
  const auto number = static_cast<std::uint32_t>(nodes_.size());
  Node node{{}, first, last, 0};
  for (std::uint32_t n = first; n < last; ++n)
    for (std::size_t k = 0; k < 3; ++k) node.box.extendBy(corner(order_[n], k));
  nodes_.push_back(node);
  if (last - first <= kMostInLeaf) return number;
  const auto axis = static_cast<int>(node.box.majorAxis());
  const auto middleOf = [&](std::uint32_t t) {
    return corner(t, 0)[axis] + corner(t, 1)[axis] + corner(t, 2)[axis];
  };
  const std::uint32_t middle = first + (last - first) / 2;
  std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + last,
                   [&](std::uint32_t a, std::uint32_t b) { return middleOf(a) < middleOf(b); });
  build(first, middle);
  const std::uint32_t second = build(middle, last);
  nodes_[number].second = second;
  return number;
}

std::vector<JudgedSheet> SheetJudge::along(const V3d& origin, const V3d& direction, double near,
                                           double far) const {
  // The end of a segment beyond all triangles.
  const Box3d& all = nodes_[0].box;
  const double reach = 1 + 2 * ((all.center() - origin).length() + (all.max - all.min).length());
  const V3d end = origin + direction * reach;
  std::vector<JudgedSheet> found;
  const auto test = [&](std::uint32_t triangle) {
    const V3d &a = corner(triangle, 0), &b = corner(triangle, 1), &c = corner(triangle, 2);
    using levelset::convert::orient3d;
    const int sides[3] = {orient3d(origin, end, a, b), orient3d(origin, end, b, c),
                          orient3d(origin, end, c, a)};
    const auto [low, high] = std::minmax({sides[0], sides[1], sides[2]});
    if ((low < 0 && high > 0) || (low == 0 && high == 0)) return;
    using Long = long double;
    const V3d u = b - a, v = c - a, w = a - origin;
    const Long x = Long{u.y} * v.z - Long{u.z} * v.y, y = Long{u.z} * v.x - Long{u.x} * v.z,
               z = Long{u.x} * v.y - Long{u.y} * v.x;
    const Long slope = x * direction.x + y * direction.y + z * direction.z;
    if (slope == 0) return;
    const auto t = static_cast<double>((x * w.x + y * w.y + z * w.z) / slope);
    if (t > near && t <= far) found.push_back({t, sheets_->triangles[triangle].label, triangle});
  };
  std::vector<std::uint32_t> stack{0};
  while (!stack.empty()) {
    const std::uint32_t number = stack.back();
    stack.pop_back();
    const Node& node = nodes_[number];
    if (!mayMeet(node.box, origin, direction, near, far)) continue;
    if (node.second == 0) {
      for (std::uint32_t n = node.first; n < node.last; ++n) test(order_[n]);
    } else {
      stack.push_back(node.second);
      stack.push_back(number + 1);
    }
  }
  std::sort(found.begin(), found.end(), [](const JudgedSheet& a, const JudgedSheet& b) {
    return std::tie(a.t, a.triangle) < std::tie(b.t, b.triangle);
  });
  return found;
}

SheetJudge::Normals SheetJudge::normalsAt(std::uint32_t triangle, const V3d& position,
                                          const V3d& direction) const {
  const V3d &a = corner(triangle, 0), &b = corner(triangle, 1), &c = corner(triangle, 2);
  const V3d area = (b - a).cross(c - a);
  // Shares of the corners by the areas opposite to them.
  const auto& normals = sheets_->triangles[triangle].normals;
  V3d smooth = V3d(normals[0]) * ((c - b).cross(position - b) ^ area) +
               V3d(normals[1]) * ((a - c).cross(position - c) ^ area) +
               V3d(normals[2]) * ((b - a).cross(position - a) ^ area);
  smooth = smooth.length() > 0 ? smooth.normalized() : -direction;
  const bool isSliver = area.length() < SheetSurface::kSliver * voxelSize_ * voxelSize_;
  V3d facet = isSliver ? smooth : area.normalized();
  if ((facet ^ direction) > 0) facet = -facet;
  if ((facet ^ smooth) < 0) smooth = -smooth;
  return {facet, smooth};
}

}  // namespace render
