#pragma once

// The prisms of [Sigg06, 4.2.3] as published, for the benchmark and its tests: each triangle's
// prism ends at the bisector planes of its edges, on both sides of the triangle.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "levelset/mesh_sign/local_mesh.h"

namespace support {

/// Bisector planes through the edges at a vertex, in order around it. A point, relative to the
/// vertex, lies in the prism of face i if it is to the right of plane i, normal · p ≥ 0, and to the
/// left of plane i + 1.
struct VertexPlanes {
  std::vector<Imath::V3d> normals;
  bool isSaddle = false;  ///< some edges at the vertex are convex, others concave

  /// @param ring  neighbours of the vertex, relative to it, counter-clockwise from outside
  explicit VertexPlanes(const std::vector<Imath::V3d>& ring) {
    using Imath::V3d;
    const std::size_t count = ring.size();
    std::vector<V3d> faces;
    for (std::size_t i = 0; i < count; ++i)
      faces.push_back(ring[i].cross(ring[(i + 1) % count]).normalized());
    bool anyConvex = false, anyConcave = false;
    for (std::size_t i = 0; i < count; ++i) {
      const V3d &before = faces[(i + count - 1) % count], &after = faces[i];
      normals.push_back((before + after).cross(ring[i]).normalized());
      // Positive if the next neighbour lies below the face before the edge.
      const double bend = -before.dot(ring[(i + 1) % count].normalized());
      constexpr double kFlat = 1e-9;
      anyConvex = anyConvex || bend > kFlat;
      anyConcave = anyConcave || bend < -kFlat;
    }
    isSaddle = anyConvex && anyConcave;
  }

  /// Number of faces whose prism contains the point, if the planes were all that bounds them.
  [[nodiscard]] std::size_t prismsAt(const Imath::V3d& p) const {
    std::size_t result = 0;
    for (std::size_t i = 0; i < normals.size(); ++i)
      result += normals[i].dot(p) >= 0 && normals[(i + 1) % normals.size()].dot(p) <= 0;
    return result;
  }

  /// Direction in the middle of the gap: points to the right of all planes, or, with the opposite
  /// direction, to the left of all. Zero if there is no gap. The gap is a cone whose edges are
  /// intersections of two planes. All pairs of planes are tried. Sigg tries consecutive ones, which
  /// is not sufficient.
  [[nodiscard]] Imath::V3d gap(bool onlyConsecutive = false) const {
    using Imath::V3d;
    constexpr double kOnPlane = 1e-12;
    const std::size_t count = normals.size();
    V3d sum(0);
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t j = i + 1; j < count; ++j) {
        if (onlyConsecutive && j != i + 1 && !(i == 0 && j == count - 1)) continue;
        const V3d cross = normals[i].cross(normals[j]);
        if (cross.length() < kOnPlane) continue;
        for (const V3d& edge : {cross.normalized(), -cross.normalized()})
          if (std::all_of(normals.begin(), normals.end(),
                          [&](const V3d& n) { return n.dot(edge) >= -kOnPlane; }))
            sum += edge;
      }
    if (sum.length() < kOnPlane) return V3d(0);
    const V3d middle = sum.normalized();
    const bool isInside = std::all_of(normals.begin(), normals.end(),
                                      [&](const V3d& n) { return n.dot(middle) > kOnPlane; });
    return isInside ? middle : V3d(0);
  }
};

/// The prisms of a closed, consistently oriented mesh.
class BisectorPrisms {
 public:
  enum class Gaps { Keep, Repair };

  /// @param gaps  Repair: moves planes at vertices with a gap outwards, so that the prisms contain
  ///              the middle of the gap up to `reach`
  BisectorPrisms(const levelset::convert::LocalMesh& mesh, double reach, Gaps gaps)
      : mesh_(mesh), reach_(reach), shifts_(mesh.triangles.size()) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<std::uint32_t, std::uint32_t>>
        sides;  // triangle and corner of a directed edge
    normals_.reserve(mesh.triangles.size());
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      const Imath::V3d &a = mesh.corner(t, 0), &b = mesh.corner(t, 1), &c = mesh.corner(t, 2);
      normals_.push_back((b - a).cross(c - a).normalized());
      for (std::uint32_t k = 0; k < 3; ++k)
        sides[{mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]}] = {t, k};
    }
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      std::array<Imath::V3d, 3> planes;
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t from = mesh.triangles[t][k], to = mesh.triangles[t][(k + 1) % 3];
        const Imath::V3d both = normals_[t] + normals_[sides.at({to, from}).first];
        planes[k] = (mesh.points[to] - mesh.points[from]).cross(both).normalized();
      }
      planes_.push_back(planes);
    }
    std::vector<std::pair<std::uint32_t, std::uint32_t>> start(
        mesh.points.size(), {std::numeric_limits<std::uint32_t>::max(), 0});
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
      for (std::uint32_t k = 0; k < 3; ++k) start[mesh.triangles[t][k]] = {t, k};
    for (std::uint32_t v = 0; v < mesh.points.size(); ++v) {
      if (start[v].first == std::numeric_limits<std::uint32_t>::max()) continue;
      std::vector<Imath::V3d> ring;
      std::vector<std::pair<std::uint32_t, std::uint32_t>> faces;
      for (auto at = start[v]; faces.empty() || at != start[v];) {
        faces.push_back(at);
        const auto& t = mesh.triangles[at.first];
        ring.push_back(mesh.points[t[(at.second + 1) % 3]] - mesh.points[v]);
        at = sides.at({v, t[(at.second + 2) % 3]});
      }
      ++vertices_;
      const VertexPlanes planes(ring);
      saddles_ += planes.isSaddle;
      const Imath::V3d gap = planes.gap();
      if (gap == Imath::V3d(0)) continue;
      ++gaps_;
      if (gaps == Gaps::Repair)
        for (const auto& [t, k] : faces)
          for (const std::uint32_t edge : {k, (k + 2) % 3}) {
            // A gap and its antipode lie on both sides of each plane.
            const double shift = std::abs(planes_[t][edge].dot(gap)) * reach;
            shifts_[t][edge] = std::max(shifts_[t][edge], shift);
          }
    }
  }

  [[nodiscard]] std::size_t vertices() const { return vertices_; }
  [[nodiscard]] std::size_t saddles() const { return saddles_; }
  [[nodiscard]] std::size_t gaps() const { return gaps_; }

  [[nodiscard]] bool contains(std::uint32_t t, const Imath::V3d& p) const {
    constexpr double kSlack = 1e-9;
    if (std::abs(normals_[t].dot(p - mesh_.corner(t, 0))) > reach_) return false;
    for (std::uint32_t k = 0; k < 3; ++k)
      if (planes_[t][k].dot(p - mesh_.corner(t, k)) > shifts_[t][k] + kSlack * reach_) return false;
    return true;
  }

 private:
  const levelset::convert::LocalMesh& mesh_;
  double reach_;
  std::size_t vertices_ = 0, saddles_ = 0, gaps_ = 0;
  std::vector<Imath::V3d> normals_;
  std::vector<std::array<Imath::V3d, 3>> planes_;  // normals, outwards
  std::vector<std::array<double, 3>> shifts_;
};

}  // namespace support
