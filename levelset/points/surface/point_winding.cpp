#include "levelset/points/surface/point_winding.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace levelset::points {
namespace {

using Imath::V3d;

constexpr std::size_t kPointsPerGroup = 8;

/// Area of a cell of the hexagonal lattice with a point's spacing.
double areaOf(const OrientedPoints& points, std::size_t i) {
  return std::numbers::sqrt3 / 2 * points.spacings[i] * points.spacings[i];
}

}  // namespace

PointWinding::PointWinding(const OrientedPoints& points) : points_(points) {
  while (points.size() > kPointsPerGroup * (firstLeaf_ + 1)) firstLeaf_ = 2 * firstLeaf_ + 1;
  groups_.resize(2 * firstLeaf_ + 1);
  build(0, 0, points.size());
}

void PointWinding::build(std::size_t group, std::size_t begin, std::size_t end) {
  Group& g = groups_[group];
  double areas = 0;
  for (std::size_t i = begin; i < end; ++i) {
    const double area = areaOf(points_, i);
    areas += area;
    g.centre += area * points_.positions[i];
  }
  g.centre /= areas;
  for (std::size_t i = begin; i < end; ++i) {
    const V3d arm = points_.positions[i] - g.centre,
              normal = areaOf(points_, i) * points_.normals[i];
    g.dipole += normal;
    for (int k = 0; k < 3; ++k) g.moment[static_cast<std::size_t>(k)] += arm[k] * normal;
    g.squaredRadius = std::max(g.squaredRadius, arm.length2());
  }
  if (group >= firstLeaf_) return;
  // The search tree halves its lists in the same way, so a group is compact.
  const std::size_t middle = begin + (end - begin) / 2;
  tbb::parallel_invoke([&] { build(2 * group + 1, begin, middle); },
                       [&] { build(2 * group + 2, middle, end); });
}

/// Winding number of a far group, without the factor 1/4π: ∫ n · r / |r|³ with r = y − x, expanded
/// to first order about the centre.
double PointWinding::far(const Group& group, const V3d& away, double squared) const {
  const double inverse2 = 1 / squared, inverse3 = inverse2 * std::sqrt(inverse2);
  double sum = away.dot(group.dipole);
  for (int k = 0; k < 3; ++k) {
    const V3d& row = group.moment[static_cast<std::size_t>(k)];
    sum += row[k] - 3 * inverse2 * away[k] * away.dot(row);
  }
  return inverse3 * sum;
}

double PointWinding::at(const V3d& position) const {
  struct Range {
    std::size_t group, begin, end;
  };
  std::array<Range, 64> stack;
  std::size_t top = 0;
  stack[top++] = {0, 0, points_.size()};
  // Error below 0.01 near closed clouds: a group is far beyond twice its radius [Barill18].
  constexpr double kSquaredFar = 4;
  double sum = 0;
  while (top > 0) {
    const Range range = stack[--top];
    const Group& group = groups_[range.group];
    const V3d away = group.centre - position;
    const double squared = away.length2();
    if (squared > kSquaredFar * group.squaredRadius) {
      sum += far(group, away, squared);
    } else if (range.group >= firstLeaf_) {
      for (std::size_t i = range.begin; i < range.end; ++i) {
        const V3d r = points_.positions[i] - position;
        const double distance2 =
            std::max(r.length2(), points_.spacings[i] * points_.spacings[i] / 4);
        sum += areaOf(points_, i) * r.dot(points_.normals[i]) / (distance2 * std::sqrt(distance2));
      }
    } else {
      const std::size_t middle = range.begin + (range.end - range.begin) / 2;
      stack[top++] = {2 * range.group + 2, middle, range.end};
      stack[top++] = {2 * range.group + 1, range.begin, middle};
    }
  }
  return sum / (4 * std::numbers::pi);
}

}  // namespace levelset::points
