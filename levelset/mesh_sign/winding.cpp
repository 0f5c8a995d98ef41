#include "levelset/mesh_sign/winding.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "levelset/mesh_sign/mesh_queries.h"

namespace levelset {

double windingNumber(const TriMesh& mesh, const Imath::V3d& point) {
  double sum = 0;
  for (const auto& t : mesh.triangles)
    sum += convert::solidAngle(mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]],
                               point);
  return sum;
}

namespace convert {
namespace {

using Imath::V3d;

constexpr std::size_t kLeafSize = 8;
constexpr double kQuarterPi = 0.25 / std::numbers::pi;  // 1 / 4π

V3d areaVector(const WeightedTriangle& t) {
  return (t.corners[1] - t.corners[0]).cross(t.corners[2] - t.corners[0]) * (t.weight / 2);
}

V3d centroid(const WeightedTriangle& t) {
  return (t.corners[0] + t.corners[1] + t.corners[2]) / 3;
}

/// Number of nodes of the tree over `count` triangles.
std::size_t nodeCount(std::size_t count) {
  return count <= kLeafSize ? 1 : 1 + nodeCount(count / 2) + nodeCount(count - count / 2);
}

/// Bound on the triangle's winding number at all points of the ball around `centre`: its area,
/// divided by 4π times the smallest possible squared distance. Infinite if they may touch.
double boundOf(const WeightedTriangle& t, const V3d& centre, double radius) {
  const V3d middle = centroid(t);
  double reach = 0;
  for (const V3d& p : t.corners) reach = std::max(reach, (p - middle).length());
  const double gap = (middle - centre).length() - reach - radius;
  if (gap <= 0) return std::numeric_limits<double>::infinity();
  return kQuarterPi * areaVector(t).length() / (gap * gap);
}

double turns(const WeightedTriangle& t, const V3d& point) {
  return t.weight * solidAngle(t.corners[0], t.corners[1], t.corners[2], point);
}

}  // namespace

double solidAngle(const V3d& a, const V3d& b, const V3d& c, const V3d& point) {
  const V3d u = a - point, v = b - point, w = c - point;
  const double lu = u.length(), lv = v.length(), lw = w.length();
  const double numerator = u.dot(v.cross(w));
  const double denominator = lu * lv * lw + u.dot(v) * lw + v.dot(w) * lu + w.dot(u) * lv;
  // On the triangle, returns 0: the mean of the values +1/2 and −1/2 on its two sides.
  if (numerator == 0 && denominator <= 0) return 0;
  return std::atan2(numerator, denominator) * 2 * kQuarterPi;
}

WindingField::WindingField(const std::vector<WeightedTriangle>& triangles) {
  for (const WeightedTriangle& t : triangles) {
    const auto first = static_cast<std::uint32_t>(own_.size());
    own_.insert(own_.end(), t.corners.begin(), t.corners.end());
    triangles_.push_back({{first, first + 1, first + 2}, static_cast<float>(t.weight)});
  }
  points_ = own_;
  buildAll();
}

WindingField::WindingField(const LocalMesh& mesh) : points_(mesh.points) {
  triangles_.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) triangles_.push_back({t, 1});
  buildAll();
}

void WindingField::buildAll() {
  if (triangles_.empty()) return;
  nodes_.reserve(nodeCount(triangles_.size()));
  build(0, triangles_.size());
}

WeightedTriangle WindingField::triangle(std::size_t i) const {
  const Member& t = triangles_[i];
  return {{points_[t.corners[0]], points_[t.corners[1]], points_[t.corners[2]]},
          static_cast<double>(t.weight)};
}

WindingField::Node WindingField::summarise(std::size_t begin, std::size_t end) const {
  Node node;
  node.begin = static_cast<std::uint32_t>(begin);
  node.end = static_cast<std::uint32_t>(end);
  V3d plain(0), weighted(0);
  for (std::size_t i = begin; i < end; ++i) {
    const WeightedTriangle t = triangle(i);
    const double area = areaVector(t).length();
    const V3d middle = centroid(t);
    node.area += area;
    weighted += middle * area;
    plain += middle;
  }
  node.centre = node.area > 0 ? weighted / node.area : plain / static_cast<double>(end - begin);
  node.dipole = V3d(0);
  node.moment = {V3d(0), V3d(0), V3d(0)};
  for (std::size_t i = begin; i < end; ++i) {
    const WeightedTriangle t = triangle(i);
    const V3d normal = areaVector(t), arm = centroid(t) - node.centre;
    node.dipole += normal;
    for (unsigned k = 0; k < 3; ++k) node.moment[k] += normal * arm[static_cast<int>(k)];
    double reach = 0;
    for (const V3d& p : t.corners) reach = std::max(reach, (p - node.centre).length2());
    node.spread += normal.length() * reach;
    node.radius = std::max(node.radius, std::sqrt(reach));
  }
  return node;
}

void WindingField::build(std::size_t begin, std::size_t end) {
  const std::size_t self = nodes_.size();
  nodes_.push_back(summarise(begin, end));
  if (end - begin <= kLeafSize) return;
  V3d low = centroid(triangle(begin)), high = low;
  for (std::size_t i = begin; i < end; ++i) {
    const V3d middle = centroid(triangle(i));
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], middle[axis]);
      high[axis] = std::max(high[axis], middle[axis]);
    }
  }
  const V3d size = high - low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
  const auto at = [&](std::size_t i) {
    return triangles_.begin() + static_cast<std::ptrdiff_t>(i);
  };
  const std::size_t middle = begin + (end - begin) / 2;
  const auto along = [&](const Member& t) {
    return (points_[t.corners[0]][axis] + points_[t.corners[1]][axis] +
            points_[t.corners[2]][axis]) /
           3;
  };
  std::nth_element(at(begin), at(middle), at(end),
                   [&](const Member& s, const Member& t) { return along(s) < along(t); });
  build(begin, middle);
  nodes_[self].right = static_cast<std::uint32_t>(nodes_.size());
  build(middle, end);
}

/// Winding number of a far node at x = `point`: 1/4π times ∫ n · (y − x) / |y − x|³ over its
/// triangles. The integrand is expanded to first order about the node's centre.
double WindingField::far(const Node& node, const V3d& point) const {
  const V3d r = node.centre - point;
  const double inverse2 = 1 / r.length2(), inverse3 = inverse2 * std::sqrt(inverse2);
  double sum = r.dot(node.dipole);
  for (unsigned k = 0; k < 3; ++k) {
    const int axis = static_cast<int>(k);
    sum += node.moment[k][axis] - 3 * inverse2 * r[axis] * r.dot(node.moment[k]);
  }
  return kQuarterPi * inverse3 * sum;
}

double WindingField::exact(const V3d& point) const {
  double sum = 0;
  for (std::size_t i = 0; i < triangles_.size(); ++i) sum += turns(triangle(i), point);
  return sum;
}

double WindingField::within(double tolerance, const V3d& point) const {
  if (nodes_.empty() || nodes_[0].area <= 0) return 0;
  const double perArea = tolerance / nodes_[0].area;
  double sum = 0;
  std::array<std::size_t, 128> stack;
  std::size_t top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const std::size_t index = stack[--top];
    const Node& node = nodes_[index];
    const double gap = (node.centre - point).length() - node.radius;
    // Second derivatives of r / |r|³ are at most 6 / |r|⁴. The nodes share the tolerance in
    // proportion to their areas.
    const double error = 3 * kQuarterPi * node.spread;
    if (gap > 0 && error <= perArea * node.area * (gap * gap) * (gap * gap)) {
      sum += far(node, point);
    } else if (node.right == 0) {
      for (std::size_t i = node.begin; i < node.end; ++i) sum += turns(triangle(i), point);
    } else {
      stack[top++] = node.right;
      stack[top++] = index + 1;
    }
  }
  return sum;
}

double WindingField::bound(const V3d& centre, double radius) const {
  if (nodes_.empty()) return 0;
  double sum = 0;
  std::array<std::size_t, 128> stack;
  std::size_t top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const std::size_t index = stack[--top];
    const Node& node = nodes_[index];
    const double gap = (node.centre - centre).length() - node.radius - radius;
    if (gap > node.radius + radius) {
      sum += kQuarterPi * node.area / (gap * gap);
    } else if (node.right == 0) {
      for (std::size_t i = node.begin; i < node.end; ++i)
        sum += boundOf(triangle(i), centre, radius);
    } else {
      stack[top++] = node.right;
      stack[top++] = index + 1;
    }
  }
  return sum;
}

}  // namespace convert
}  // namespace levelset
