#include "levelset/mesh_sign/self_intersections.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "levelset/geometry/exact_predicates.h"
#include "levelset/mesh_sign/mesh_queries.h"
#include "levelset/mesh_sign/mesh_topology.h"
#include "levelset/progress_gate.h"

namespace levelset {
namespace {

using convert::Triangle;
using Imath::V2d;
using Imath::V3d;

using Pair = convert::TrianglePair;
using TriangleCorners = std::array<V3d, 3>;

V2d dropAxis(const V3d& p, int axis) {
  return {p[(axis + 1) % 3], p[(axis + 2) % 3]};
}

/// Axis (0 to 2) along which the triangle projects to a triangle with area, preferably the one with
/// the largest area. −1 for a triangle with exactly zero area.
int projectionAxis(const TriangleCorners& t) {
  const V3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
  std::array<int, 3> axes = {0, 1, 2};
  std::sort(axes.begin(), axes.end(),
            [&](int a, int b) { return std::abs(normal[a]) > std::abs(normal[b]); });
  for (const int axis : axes)
    if (convert::orient2d(dropAxis(t[0], axis), dropAxis(t[1], axis), dropAxis(t[2], axis)) != 0)
      return axis;
  return -1;
}

/// Returns true when p lies on the segment from a to b. The three points must be collinear.
bool isBetween(const V2d& a, const V2d& b, const V2d& p) {
  return p.x >= std::min(a.x, b.x) && p.x <= std::max(a.x, b.x) && p.y >= std::min(a.y, b.y) &&
         p.y <= std::max(a.y, b.y);
}

/// Returns true when two closed segments in the plane have a point in common.
bool segmentsMeet(const V2d& a, const V2d& b, const V2d& c, const V2d& d) {
  const int c1 = convert::orient2d(a, b, c), d1 = convert::orient2d(a, b, d);
  const int a1 = convert::orient2d(c, d, a), b1 = convert::orient2d(c, d, b);
  if (c1 * d1 < 0 && a1 * b1 < 0) return true;
  return (c1 == 0 && isBetween(a, b, c)) || (d1 == 0 && isBetween(a, b, d)) ||
         (a1 == 0 && isBetween(c, d, a)) || (b1 == 0 && isBetween(c, d, b));
}

/// Returns true when p lies in the closed triangle, in the plane.
bool contains(const std::array<V2d, 3>& t, const V2d& p) {
  const int s0 = convert::orient2d(t[0], t[1], p), s1 = convert::orient2d(t[1], t[2], p),
            s2 = convert::orient2d(t[2], t[0], p);
  return (s0 >= 0 && s1 >= 0 && s2 >= 0) || (s0 <= 0 && s1 <= 0 && s2 <= 0);
}

/// Returns true when the closed segment pq and the closed triangle, all in one plane, have a point
/// in common.
bool meetsInPlane(const V3d& p, const V3d& q, const TriangleCorners& t) {
  const int axis = projectionAxis(t);
  const std::array<V2d, 3> f = {dropAxis(t[0], axis), dropAxis(t[1], axis), dropAxis(t[2], axis)};
  const V2d a = dropAxis(p, axis), b = dropAxis(q, axis);
  return contains(f, a) || contains(f, b) || segmentsMeet(a, b, f[0], f[1]) ||
         segmentsMeet(a, b, f[1], f[2]) || segmentsMeet(a, b, f[2], f[0]);
}

/// Returns true when the closed segment pq and the closed triangle have a point in common.
/// @param sideP, sideQ  sides of the triangle's plane on which p and q lie, as orient3d gives them
bool segmentMeets(const V3d& p, const V3d& q, int sideP, int sideQ, const TriangleCorners& t) {
  if (sideP * sideQ > 0) return false;
  if (sideP == 0 && sideQ == 0) return meetsInPlane(p, q, t);
  // As seen along pq, the three edges of the triangle must turn about the line pq in one direction.
  const int s0 = convert::orient3d(p, q, t[0], t[1]), s1 = convert::orient3d(p, q, t[1], t[2]),
            s2 = convert::orient3d(p, q, t[2], t[0]);
  return (s0 >= 0 && s1 >= 0 && s2 >= 0) || (s0 <= 0 && s1 <= 0 && s2 <= 0);
}

/// Returns true when a line through the common first corner separates the two triangles, projected
/// along projectionAxis(a). They then share that corner only. This decides nearly all pairs of
/// triangles in a flat fan, for which orient3d would need exact arithmetic.
bool separateAtCorner(const TriangleCorners& a, const TriangleCorners& b) {
  const int axis = projectionAxis(a);
  const V2d corner = dropAxis(a[0], axis);
  const std::array<V2d, 2> p = {dropAxis(a[1], axis), dropAxis(a[2], axis)};
  const std::array<V2d, 2> q = {dropAxis(b[1], axis), dropAxis(b[2], axis)};
  const auto isBetween = [&corner](const std::array<V2d, 2>& first,
                                   const std::array<V2d, 2>& second) {
    const int side = convert::orient2d(corner, first[0], first[1]);
    const int s0 = convert::orient2d(corner, first[0], second[0]),
              s1 = convert::orient2d(corner, first[0], second[1]);
    if (side * s0 < 0 && side * s1 < 0) return true;
    const int t0 = convert::orient2d(corner, first[1], second[0]),
              t1 = convert::orient2d(corner, first[1], second[1]);
    return side * t0 > 0 && side * t1 > 0;
  };
  return isBetween(p, q) || isBetween(q, p);
}

/// Returns true when the two triangles meet outside their shared vertices and edge, or share all
/// three vertices.
bool trianglesMeet(const Triangle& first, const Triangle& second,
                   const std::vector<V3d>& positions) {
  // Rotate the shared vertices to the front. Faces of a 2-manifold traverse a shared edge in
  // opposite directions, which does not matter here.
  Triangle s = first, t = second;
  std::size_t shared = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = shared; j < 3; ++j)
      if (s[i] == t[j]) {
        std::swap(s[i], s[shared]);
        std::swap(t[j], t[shared]);
        ++shared;
        break;
      }
  const TriangleCorners a = {positions[s[0]], positions[s[1]], positions[s[2]]};
  const TriangleCorners b = {positions[t[0]], positions[t[1]], positions[t[2]]};
  if (shared == 3) return true;
  if (shared == 2) {
    if (convert::orient3d(a[0], a[1], a[2], b[2]) != 0) return false;
    const int axis = projectionAxis(a);
    const V2d p = dropAxis(a[0], axis), q = dropAxis(a[1], axis);
    return convert::orient2d(p, q, dropAxis(a[2], axis)) ==
           convert::orient2d(p, q, dropAxis(b[2], axis));
  }
  if (shared == 1 && separateAtCorner(a, b)) return false;
  // Sides on which the corners of each triangle lie, relative to the plane of the other one.
  std::array<int, 3> sideA{}, sideB{};
  for (std::size_t i = shared; i < 3; ++i) sideA[i] = convert::orient3d(b[0], b[1], b[2], a[i]);
  if (shared == 0 && sideA[0] == sideA[1] && sideA[1] == sideA[2] && sideA[0] != 0) return false;
  if (shared == 1 && sideA[1] == sideA[2] && sideA[1] != 0) return false;
  for (std::size_t i = shared; i < 3; ++i) sideB[i] = convert::orient3d(a[0], a[1], a[2], b[i]);
  if (shared == 1)
    return segmentMeets(a[1], a[2], sideA[1], sideA[2], b) ||
           segmentMeets(b[1], b[2], sideB[1], sideB[2], a);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    if (segmentMeets(a[i], a[j], sideA[i], sideA[j], b)) return true;
    if (segmentMeets(b[i], b[j], sideB[i], sideB[j], a)) return true;
  }
  return false;
}

/// Finds intersecting triangles by halving space across its longest side until each part contains
/// few triangles. If several parts contain the same pair, one part reports it: the part that
/// contains the lowest corner of the intersection of the two triangles' bounding boxes.
class PairSearch {
 public:
  PairSearch(const std::vector<Triangle>& triangles, const std::vector<V3d>& positions,
             const Progress& progress)
      : positions_(positions), progress_(progress), triangles_(triangles) {
    boxes_.resize(triangles_.size());
    for (std::size_t i = 0; i < triangles_.size(); ++i)
      for (const std::uint32_t v : triangles_[i]) boxes_[i].extendBy(positions_[v]);
  }

  std::vector<Pair> find() {
    List all;
    Imath::Box3d region;
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      const Triangle& t = triangles_[i];
      if (projectionAxis({positions_[t[0]], positions_[t[1]], positions_[t[2]]}) < 0) continue;
      all.push_back(static_cast<std::uint32_t>(i));
      region.extendBy(boxes_[i]);
    }
    end_ = region.max;
    split(std::move(all), region, 0);
    std::vector<std::vector<Pair>> found(parts_.size());
    const Progress second = subProgress(progress_, 0.5, 1);
    ProgressGate gate(second, parts_.size());
    tbb::parallel_for(std::size_t{0}, parts_.size(), [&](std::size_t i) {
      found[i] = findIn(parts_[i], gate);
      gate.advance(1);
    });
    std::vector<Pair> result;
    for (const auto& part : found) result.insert(result.end(), part.begin(), part.end());
    std::sort(result.begin(), result.end());
    return result;
  }

 private:
  using List = std::vector<std::uint32_t>;
  struct Part {
    List triangles;
    Imath::Box3d region;  // box of the part, without its upper faces, except where they
                          // bound the mesh
  };
  static constexpr std::size_t kFew = 24;
  static constexpr int kDeepest = 60;

  void split(List all, const Imath::Box3d& region, int depth) {
    if (all.size() > 1000) report(progress_, 0);
    const V3d size = region.size();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
    const double middle = region.min[axis] + size[axis] / 2;
    if (all.size() > kFew && depth < kDeepest && middle > region.min[axis] &&
        middle < region.max[axis]) {
      List low, high;
      for (const std::uint32_t i : all) {
        if (boxes_[i].min[axis] < middle) low.push_back(i);
        if (boxes_[i].max[axis] >= middle) high.push_back(i);
      }
      // Where most triangles extend into both halves, halving does not help.
      if (low.size() + high.size() < all.size() + all.size() / 2) {
        List().swap(all);
        Imath::Box3d lowRegion = region, highRegion = region;
        lowRegion.max[axis] = highRegion.min[axis] = middle;
        split(std::move(low), lowRegion, depth + 1);
        split(std::move(high), highRegion, depth + 1);
        return;
      }
    }
    if (all.size() > 1) parts_.push_back({std::move(all), region});
  }

  [[nodiscard]] bool belongs(const Part& part, std::uint32_t i, std::uint32_t j) const {
    for (int axis = 0; axis < 3; ++axis) {
      const double low = std::max(boxes_[i].min[axis], boxes_[j].min[axis]);
      if (low < part.region.min[axis]) return false;
      if (low >= part.region.max[axis] && part.region.max[axis] < end_[axis]) return false;
    }
    return true;
  }

  [[nodiscard]] std::vector<Pair> findIn(const Part& part, ProgressGate& gate) const {
    List order = part.triangles;
    std::sort(order.begin(), order.end(), [&](std::uint32_t i, std::uint32_t j) {
      return boxes_[i].min.x != boxes_[j].min.x ? boxes_[i].min.x < boxes_[j].min.x : i < j;
    });
    std::vector<Pair> found;
    for (std::size_t m = 0; m < order.size(); ++m) {
      const std::uint32_t i = order[m];
      for (std::size_t n = m + 1; n < order.size(); ++n) {
        const std::uint32_t j = order[n];
        if (boxes_[j].min.x > boxes_[i].max.x) break;
        if (boxes_[i].intersects(boxes_[j]) && belongs(part, i, j) &&
            trianglesMeet(triangles_[i], triangles_[j], positions_))
          found.push_back(std::minmax(i, j));
      }
      if (m % 256 == 255) gate.advance(0);
    }
    return found;
  }

  const std::vector<V3d>& positions_;
  const Progress& progress_;
  const std::vector<Triangle>& triangles_;
  std::vector<Imath::Box3d> boxes_;
  V3d end_;
  std::vector<Part> parts_;
};

}  // namespace

std::vector<convert::TrianglePair> convert::findSelfIntersections(
    const std::vector<Triangle>& triangles, const std::vector<V3d>& positions,
    const Progress& progress) {
  return PairSearch(triangles, positions, progress).find();
}

std::size_t countSelfIntersections(const TriMesh& mesh, const Progress& progress) {
  return convert::findSelfIntersections(convert::findTopology(mesh).triangles, mesh.positions,
                                        progress)
      .size();
}

}  // namespace levelset
