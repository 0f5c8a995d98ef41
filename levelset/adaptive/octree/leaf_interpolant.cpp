#include "levelset/adaptive/octree/leaf_interpolant.h"

namespace levelset {
namespace {

using Imath::V3d;

double trilinear(const std::array<double, 8>& v, const V3d& at) {
  const auto mix = [](double a, double b, double t) { return a + (b - a) * t; };
  const double low = mix(mix(v[0], v[1], at.x), mix(v[2], v[3], at.x), at.y),
               high = mix(mix(v[4], v[5], at.x), mix(v[6], v[7], at.x), at.y);
  return mix(low, high, at.z);
}

/// Cubic less the linear interpolant on an edge: a t (1 − t)² − b t² (1 − t).
struct Bump {
  double a, b;

  [[nodiscard]] double value(double t) const { return t * (1 - t) * (a * (1 - t) - b * t); }
  [[nodiscard]] double slope(double t) const {
    return a * (1 - t) * (1 - 3 * t) - b * t * (2 - 3 * t);
  }
};

/// Calls visit(axis, u, v, i, j, bump) for the twelve edges: `u` and `v` are the other axes, `i`
/// and `j` the coordinates of the edge along them.
template <class Visit>
void forEachEdge(const LeafInterpolant& leaf, const Visit& visit) {
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const auto& slopes = leaf.slopes[static_cast<std::size_t>(axis)];
    for (int k = 0; k < 4; ++k) {
      const int i = k & 1, j = k >> 1;
      const auto low = static_cast<std::size_t>(i << u | j << v),
                 high = low | std::size_t{1} << axis;
      const double rise = leaf.values[high] - leaf.values[low];
      visit(axis, u, v, i, j, Bump{slopes[low] - rise, slopes[high] - rise});
    }
  }
}

double weight(int end, double t) {
  return end == 0 ? 1 - t : t;
}

}  // namespace

double LeafInterpolant::value(const V3d& at) const {
  double result = trilinear(values, at);
  if (isTricubic)
    forEachEdge(*this, [&](int axis, int u, int v, int i, int j, const Bump& bump) {
      result += weight(i, at[u]) * weight(j, at[v]) * bump.value(at[axis]);
    });
  return result;
}

V3d LeafInterpolant::slope(const V3d& at) const {
  V3d result;
  for (int axis = 0; axis < 3; ++axis) {
    V3d low = at, high = at;
    low[axis] = 0;
    high[axis] = 1;
    result[axis] = trilinear(values, high) - trilinear(values, low);
  }
  if (isTricubic)
    forEachEdge(*this, [&](int axis, int u, int v, int i, int j, const Bump& bump) {
      const double alongU = weight(i, at[u]), alongV = weight(j, at[v]),
                   value = bump.value(at[axis]);
      result[axis] += alongU * alongV * bump.slope(at[axis]);
      result[u] += (i == 0 ? -alongV : alongV) * value;
      result[v] += (j == 0 ? -alongU : alongU) * value;
    });
  return result;
}

}  // namespace levelset
