#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>

#include "levelset/geometry/exact_predicates.h"
#include "levelset/segmented/sources/near_triangles_vdb.h"

namespace levelset {

using Imath::V3d;
using openvdb::Coord;

namespace {

/// Returns true if a line between two points meets a triangle, its border included.
bool meetsTriangle(const V3d& p, const V3d& q, const std::array<V3d, 3>& t) {
  const int before = convert::orient3d(t[0], t[1], t[2], p),
            after = convert::orient3d(t[0], t[1], t[2], q);
  if (before * after > 0) return false;
  const int a = convert::orient3d(p, q, t[0], t[1]), b = convert::orient3d(p, q, t[1], t[2]),
            c = convert::orient3d(p, q, t[2], t[0]);
  return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
}

}  // namespace

NearTriangles::NearTriangles(const std::vector<std::array<std::uint32_t, 3>>& triangles,
                             const std::vector<V3d>& points)
    : triangles_(&triangles), points_(&points) {
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const std::array<V3d, 3> c = corners(t);
    V3d normal = (c[1] - c[0]).cross(c[2] - c[0]);
    normal = normal.length() > 0 ? normal.normalized() : V3d(0);
    Coord low, high;
    for (int axis = 0; axis < 3; ++axis) {
      const auto [least, most] = std::minmax({c[0][axis], c[1][axis], c[2][axis]});
      low[axis] = static_cast<int>(std::floor(least + 0.5 - 1e-6));
      high[axis] = static_cast<int>(std::floor(most + 0.5 + 1e-6));
    }
    constexpr double kHalfDiagonal = 0.8661;
    for (int x = low[0]; x <= high[0]; ++x)
      for (int y = low[1]; y <= high[1]; ++y)
        for (int z = low[2]; z <= high[2]; ++z)
          if (std::abs((V3d(x, y, z) - c[0]) ^ normal) <= kHalfDiagonal)
            entries_.push_back({Coord(x, y, z), t});
  }
  tbb::parallel_sort(entries_.begin(), entries_.end());
}

std::span<const NearTriangles::Entry> NearTriangles::at(const Coord& point) const {
  const auto first = std::lower_bound(entries_.begin(), entries_.end(), std::pair(point, 0u));
  auto last = first;
  while (last != entries_.end() && last->first == point) ++last;
  return {first, last};
}

/// Returns true if the line between two grid points meets a triangle near a third one.
bool NearTriangles::meets(const Coord& from, const Coord& to, const Coord& at) const {
  const V3d p(from[0], from[1], from[2]), q(to[0], to[1], to[2]);
  for (const Entry& entry : this->at(at))
    if (meetsTriangle(p, q, corners(entry.second))) return true;
  return false;
}

bool NearTriangles::separate(const Coord& a, const Coord& b) const {
  return meets(a, b, a) || meets(a, b, b);
}

bool NearTriangles::sees(const Coord& from, const Coord& to) const {
  Coord at;
  for (at[0] = std::min(from[0], to[0]); at[0] <= std::max(from[0], to[0]); ++at[0])
    for (at[1] = std::min(from[1], to[1]); at[1] <= std::max(from[1], to[1]); ++at[1])
      for (at[2] = std::min(from[2], to[2]); at[2] <= std::max(from[2], to[2]); ++at[2])
        if (meets(from, to, at)) return false;
  return true;
}

}  // namespace levelset
