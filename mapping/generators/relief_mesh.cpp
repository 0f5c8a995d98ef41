#include "mapping/generators/relief_mesh.h"

#include <cmath>
#include <set>
#include <utility>

namespace mapping {
namespace {

using Imath::V3d;

/// Intersection of the edge from a to b with the plane where coordinate `axis` equals `side`.
/// Exchanging a and b does not change the bits.
V3d crossSide(V3d a, V3d b, int axis, double side) {
  if (std::array{b.x, b.y, b.z} < std::array{a.x, a.y, a.z}) std::swap(a, b);
  const double t = (side - a[axis]) / (b[axis] - a[axis]);
  V3d p = a + (b - a) * t;
  p[axis] = side;
  return p;
}

/// Clips a convex polygon at the plane where coordinate `axis` equals `side`.
/// @param sign  1: keeps the part with smaller coordinates; −1: keeps the part with larger
///         coordinates
std::vector<V3d> cutOff(const std::vector<V3d>& polygon, int axis, double side, double sign) {
  std::vector<V3d> kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const V3d &p = polygon[i], &next = polygon[(i + 1) % polygon.size()];
    const double here = sign * (p[axis] - side), there = sign * (next[axis] - side);
    if (here <= 0) kept.push_back(p);
    if ((here < 0 && there > 0) || (here > 0 && there < 0))
      kept.push_back(crossSide(p, next, axis, side));
  }
  return kept;
}

/// True if the polygon has a vertex that is not on the plane where coordinate `axis` equals `side`.
bool hasWidth(const std::vector<V3d>& polygon, int axis, double side) {
  for (const V3d& p : polygon)
    if (p[axis] != side) return true;
  return false;
}

}  // namespace

std::uint32_t ReliefMesh::vertex(const V3d& p) {
  // Adding zero turns −0 into 0, so that both give the same key.
  const auto [it, isNew] = vertices_.try_emplace(
      {p.x + 0.0, p.y + 0.0, p.z + 0.0}, static_cast<std::uint32_t>(mesh_.positions.size()));
  if (isNew) mesh_.positions.push_back(p);
  return it->second;
}

void ReliefMesh::addTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  if (a != b && b != c && c != a) mesh_.triangles.push_back({a, b, c});
}

void ReliefMesh::add(std::vector<V3d> corners) {
  for (V3d& p : corners)
    for (int axis = 0; axis < 2; ++axis)
      for (const double side : {rectangle_.min[axis], rectangle_.max[axis]})
        if (std::abs(p[axis] - side) < snap_) p[axis] = side;
  for (int axis = 0; axis < 2; ++axis) {
    corners = cutOff(corners, axis, rectangle_.min[axis], -1);
    if (!hasWidth(corners, axis, rectangle_.min[axis])) return;
    corners = cutOff(corners, axis, rectangle_.max[axis], 1);
    if (!hasWidth(corners, axis, rectangle_.max[axis])) return;
  }
  std::vector<std::uint32_t> loop;
  for (const V3d& p : corners) {
    const std::uint32_t v = vertex(p);
    if (loop.empty() || (loop.back() != v && loop.front() != v)) loop.push_back(v);
  }
  for (std::size_t i = 2; i < loop.size(); ++i) addTriangle(loop[0], loop[i - 1], loop[i]);
}

levelset::TriMesh ReliefMesh::close(double bottom) && {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto& t : mesh_.triangles)
    for (std::size_t i = 0; i < 3; ++i) edges.insert({t[i], t[(i + 1) % 3]});
  const Imath::V2d center = rectangle_.center();
  const auto middle = static_cast<std::uint32_t>(mesh_.positions.size());
  mesh_.positions.emplace_back(center.x, center.y, bottom);
  std::map<std::uint32_t, std::uint32_t> below;
  const auto under = [&](std::uint32_t v) {
    const auto [it, isNew] = below.try_emplace(v, 0);
    if (isNew) {
      const V3d p = mesh_.positions[v];
      it->second = p.z == bottom ? v : static_cast<std::uint32_t>(mesh_.positions.size());
      if (it->second != v) mesh_.positions.emplace_back(p.x, p.y, bottom);
    }
    return it->second;
  };
  for (const auto& [a, b] : edges) {
    if (edges.contains({b, a})) continue;
    const std::uint32_t c = under(a), d = under(b);
    addTriangle(b, a, c);
    addTriangle(b, c, d);
    addTriangle(middle, d, c);
  }
  return std::move(mesh_);
}

}  // namespace mapping
