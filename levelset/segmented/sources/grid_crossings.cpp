#include "levelset/segmented/sources/grid_crossings.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "levelset/geometry/exact_predicates.h"
#include "levelset/segmented/local/kuhn_cell.h"

namespace levelset {
namespace {

using Imath::V2d;
using Imath::V3d;
using Imath::V3i;

int signOfNumber(double x) {
  return (x > 0) - (x < 0);
}

/// Sign of (a − b) − (c − d), exact.
int compareDifferences(double a, double b, double c, double d) {
  // The rounded differences are monotonous. Where they are equal, their rounding errors decide.
  const auto difference = [](double x, double y) {
    const double rounded = x - y, part = x - rounded;
    return std::pair(rounded, (x - (rounded + part)) + (part - y));
  };
  const auto [u, uError] = difference(a, b);
  const auto [v, vError] = difference(c, d);
  return u != v ? signOfNumber(u - v) : signOfNumber(uError - vError);
}

/// Side of the line from p, along a step, on which the line from a to b passes. The line along the
/// step is moved with the grid.
int perturbedTurn(const V3d& p, const V3i& step, const V3d& a, const V3d& b) {
  const int side = convert::orient3d(p, p + V3d(step), a, b);
  if (side != 0) return side;
  // Derivative along the direction of the move: (a − b) × step.
  for (int axis = 0; axis < 3; ++axis) {
    const int j = (axis + 1) % 3, k = (axis + 2) % 3;
    int sign = 0;
    if (step[j] && step[k])
      sign = compareDifferences(a[j], b[j], a[k], b[k]);
    else if (step[k])
      sign = signOfNumber(a[j] - b[j]);
    else if (step[j])
      sign = signOfNumber(b[k] - a[k]);
    if (sign != 0) return sign;
  }
  return 0;
}

}  // namespace

int perturbedSide(const std::array<V3d, 3>& t, const V3i& at) {
  const int side = convert::orient3d(t[0], t[1], t[2], V3d(at));
  if (side != 0) return side;
  // Derivative along the direction of the move: the normal.
  for (int axis = 0; axis < 3; ++axis) {
    const int j = (axis + 1) % 3, k = (axis + 2) % 3;
    const int sign = convert::orient2d({t[0][j], t[0][k]}, {t[1][j], t[1][k]}, {t[2][j], t[2][k]});
    if (sign != 0) return sign;
  }
  return 0;
}

bool crossesTriangle(const std::array<V3d, 3>& t, const V3i& at, std::uint32_t step) {
  const V3i offset = offsetOfCorner(step);
  if (perturbedSide(t, at) * perturbedSide(t, at + offset) >= 0) return false;
  const V3d p(at);
  const int a = perturbedTurn(p, offset, t[0], t[1]), b = perturbedTurn(p, offset, t[1], t[2]);
  return a != 0 && a == b && perturbedTurn(p, offset, t[2], t[0]) == a;
}

std::vector<GridCrossing> findGridCrossings(
    const std::vector<V3d>& points, const std::vector<std::array<std::uint32_t, 3>>& triangles,
    const GridSimplices& simplices) {
  constexpr double kMargin = 1e-6;  // voxels: rounding errors of the planes are smaller
  constexpr std::size_t kChunk = 256;
  const std::size_t chunks = (triangles.size() + kChunk - 1) / kChunk;
  std::vector<std::vector<GridCrossing>> found(chunks);
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t chunk) {
    const std::size_t end = std::min(triangles.size(), (chunk + 1) * kChunk);
    for (std::size_t t = chunk * kChunk; t < end; ++t) {
      const std::array<V3d, 3> c = {points[triangles[t][0]], points[triangles[t][1]],
                                    points[triangles[t][2]]};
      V3d normal = (c[1] - c[0]).cross(c[2] - c[0]);
      if (!(normal.length() > 0)) continue;
      normal.normalize();
      // Along the axis nearest to the normal, only points near the plane come into question.
      int along = 0;
      for (int axis = 1; axis < 3; ++axis)
        if (std::abs(normal[axis]) > std::abs(normal[along])) along = axis;
      const int u = (along + 1) % 3, v = (along + 2) % 3;
      const double slope = (std::abs(normal[u]) + std::abs(normal[v])) / std::abs(normal[along]);
      V3i low, high;
      for (int axis = 0; axis < 3; ++axis) {
        const auto [least, most] = std::minmax({c[0][axis], c[1][axis], c[2][axis]});
        low[axis] = static_cast<int>(std::ceil(least - kMargin)) - 1;
        high[axis] = static_cast<int>(std::floor(most + kMargin));
      }
      V3i at;
      for (at[u] = low[u]; at[u] <= high[u]; ++at[u])
        for (at[v] = low[v]; at[v] <= high[v]; ++at[v]) {
          const double height =
              c[0][along] -
              ((at[u] - c[0][u]) * normal[u] + (at[v] - c[0][v]) * normal[v]) / normal[along];
          const int first = std::max(low[along],
                                     static_cast<int>(std::ceil(height - 1 - slope - kMargin))),
                    last = std::min(high[along],
                                    static_cast<int>(std::floor(height + slope + kMargin)));
          for (at[along] = first; at[along] <= last; ++at[along]) {
            const double here = (V3d(at) - c[0]) ^ normal;
            for (std::uint32_t step = 1; step < 8; ++step) {
              const double there = here + (V3d(offsetOfCorner(step)) ^ normal);
              if (std::min(here, there) > kMargin || std::max(here, there) < -kMargin) continue;
              if (!crossesTriangle(c, at, step)) continue;
              const double position = here != there ? here / (here - there) : 0.5;
              found[chunk].push_back({simplices.key(at, kuhn::edgeSlot(step)),
                                      std::clamp(position, 0.0, 1.0),
                                      static_cast<std::uint32_t>(t)});
            }
          }
        }
    }
  });
  std::size_t count = 0;
  for (const auto& part : found) count += part.size();
  std::vector<GridCrossing> crossings;
  crossings.reserve(count);
  for (const auto& part : found) crossings.insert(crossings.end(), part.begin(), part.end());
  tbb::parallel_sort(
      crossings.begin(), crossings.end(), [](const GridCrossing& a, const GridCrossing& b) {
        return std::tie(a.edge, a.position, a.triangle) < std::tie(b.edge, b.position, b.triangle);
      });
  return crossings;
}

}  // namespace levelset
