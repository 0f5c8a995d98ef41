#pragma once

// Baseline: the characteristics/scan-conversion algorithm (CSC) of [Mauch03] on a dense grid. Each
// face, edge and vertex has a polyhedron that contains the points it is closest to, within the half
// width of the band: towers, wedges and cones. Vertices at saddles have the cone of their closest
// points too, where [Sigg06] takes larger hulls.

#include <Imath/ImathBox.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "levelset/mesh_sign/local_mesh.h"

namespace characteristics {

using Imath::V3d;
using Imath::V3i;

/// A half-space: normal · p ≤ limit.
struct HalfSpace {
  V3d normal;
  double limit;
};

/// Signed distances on the grid points of a box, in voxels; `reach` beyond the band.
class DenseBand {
 public:
  DenseBand(const levelset::convert::LocalMesh& mesh, double reach) : reach_(reach) {
    Imath::Box3d box;
    for (const V3d& p : mesh.points) box.extendBy(p);
    for (int axis = 0; axis < 3; ++axis) {
      low_[axis] = static_cast<int>(std::floor(box.min[axis] - reach));
      size_[axis] = static_cast<int>(std::ceil(box.max[axis] + reach)) - low_[axis] + 1;
    }
    values_.assign(static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.y) *
                       static_cast<std::size_t>(size_.z),
                   static_cast<float>(reach));
    build(mesh);
  }

  /// Signed distance, or `reach` outside the box.
  [[nodiscard]] float at(const V3i& p) const {
    const V3i d = p - low_;
    for (int axis = 0; axis < 3; ++axis)
      if (d[axis] < 0 || d[axis] >= size_[axis]) return static_cast<float>(reach_);
    return values_[index(d)];
  }
  [[nodiscard]] std::size_t polyhedra() const { return polyhedra_; }

 private:
  [[nodiscard]] std::size_t index(const V3i& d) const {
    return (static_cast<std::size_t>(d.x) * static_cast<std::size_t>(size_.y) +
            static_cast<std::size_t>(d.y)) *
               static_cast<std::size_t>(size_.z) +
           static_cast<std::size_t>(d.z);
  }

  /// Offers signed distances of the grid points in a convex polyhedron.
  template <typename Distance>
  void scan(const Imath::Box3d& box, const std::vector<HalfSpace>& sides,
            const Distance& distance) {
    ++polyhedra_;
    constexpr double kSlack = 1e-9;
    V3i first, last;
    for (int axis = 0; axis < 3; ++axis) {
      first[axis] = std::max(static_cast<int>(std::ceil(box.min[axis])) - low_[axis], 0);
      last[axis] =
          std::min(static_cast<int>(std::floor(box.max[axis])) - low_[axis], size_[axis] - 1);
    }
    for (int x = first.x; x <= last.x; ++x)
      for (int y = first.y; y <= last.y; ++y) {
        const V3d row(low_.x + x, low_.y + y, 0);
        double from = low_.z + first.z, to = low_.z + last.z;
        for (const HalfSpace& side : sides) {
          const double rest = side.limit + kSlack * reach_ - side.normal.dot(row),
                       slope = side.normal.z;
          if (std::abs(slope) < 1e-14) {
            if (rest < 0) to = from - 1;
          } else if (slope > 0) {
            to = std::min(to, rest / slope);
          } else {
            from = std::max(from, rest / slope);
          }
        }
        for (int z = static_cast<int>(std::ceil(from)); z <= static_cast<int>(std::floor(to));
             ++z) {
          float& value = values_[index({x, y, z - low_.z})];
          const auto d = static_cast<float>(distance(V3d(row.x, row.y, z)));
          if (std::abs(d) < std::abs(value)) value = d;
        }
      }
  }

  static Imath::Box3d around(std::initializer_list<V3d> points, double margin) {
    Imath::Box3d box;
    for (const V3d& p : points) box.extendBy(p);
    return {box.min - V3d(margin), box.max + V3d(margin)};
  }

  void build(const levelset::convert::LocalMesh& mesh) {
    using Side = std::pair<std::uint32_t, std::uint32_t>;  // triangle and corner of a directed edge
    std::map<Side, Side> sides;
    std::vector<V3d> normals;
    std::vector<Side> start(mesh.points.size(), {std::numeric_limits<std::uint32_t>::max(), 0});
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      const V3d &a = mesh.corner(t, 0), &b = mesh.corner(t, 1), &c = mesh.corner(t, 2);
      normals.push_back((b - a).cross(c - a).normalized());
      for (std::uint32_t k = 0; k < 3; ++k) {
        sides[{mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]}] = {t, k};
        start[mesh.triangles[t][k]] = {t, k};
      }
    }
    std::vector<HalfSpace> planes;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      const V3d &a = mesh.corner(t, 0), &b = mesh.corner(t, 1), &c = mesh.corner(t, 2),
                n = normals[t];
      const double level = n.dot(a);
      planes = {{n, level + reach_}, {-n, reach_ - level}};
      for (std::uint32_t k = 0; k < 3; ++k) {
        const V3d out = (mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k)).cross(n);
        planes.push_back({out, out.dot(mesh.corner(t, k))});
      }
      Imath::Box3d box = around({a + n * reach_, b + n * reach_, c + n * reach_}, 0);
      box.extendBy(around({a - n * reach_, b - n * reach_, c - n * reach_}, 0));
      scan(box, planes, [&](const V3d& p) { return n.dot(p) - level; });
    }
    for (const auto& [edge, side] : sides) {
      if (edge.first > edge.second) continue;
      const V3d &a = mesh.points[edge.first], &b = mesh.points[edge.second];
      const V3d along = (b - a).normalized(), n = normals[side.first],
                m = normals[sides.at({edge.second, edge.first}).first];
      // Directions from the edge into its two faces.
      const V3d left = n.cross(along), right = along.cross(m);
      if (left.dot(m) == 0) continue;  // a flat edge has no wedge
      const double sign = left.dot(m) < 0 ? 1 : -1;
      planes = {{along, along.dot(b)},
                {-along, -along.dot(a)},
                {left, left.dot(a)},
                {right, right.dot(a)}};
      scan(around({a, b}, reach_), planes,
           [&](const V3d& p) { return sign * (p - a - along * along.dot(p - a)).length(); });
    }
    for (std::uint32_t v = 0; v < mesh.points.size(); ++v) {
      if (start[v].first == std::numeric_limits<std::uint32_t>::max()) continue;
      const V3d c = mesh.points[v];
      planes.clear();
      V3d normal(0);
      bool isFirst = true;
      for (Side at = start[v]; isFirst || at != start[v]; isFirst = false) {
        const auto& t = mesh.triangles[at.first];
        const V3d spoke = (mesh.points[t[(at.second + 1) % 3]] - c).normalized();
        planes.push_back({spoke, spoke.dot(c)});
        normal += normals[at.first];
        at = sides.at({v, t[(at.second + 2) % 3]});
      }
      scan(around({c}, reach_), planes, [&](const V3d& p) {
        const double d = (p - c).length();
        return normal.dot(p - c) < 0 ? -d : d;
      });
    }
  }

  double reach_;
  V3i low_, size_;
  std::vector<float> values_;
  std::size_t polyhedra_ = 0;
};

}  // namespace characteristics
