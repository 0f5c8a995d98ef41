#pragma once

#include <numbers>
#include <vector>

#include "tests/unit/levelset/points/projection/projected_points.h"

/// Clouds of solids with sharp edges. No point lies on purpose on an edge.
namespace sharp_points {

using Imath::V3d;
using levelset::PointCloud;
using levelset::TriMesh;

/// Solid between a polygon in the plane z = 0 and the same one at a height. The first vertex of the
/// polygon sees all others.
inline TriMesh prism(const std::vector<Imath::V2d>& polygon, double height) {
  TriMesh mesh;
  const auto n = static_cast<std::uint32_t>(polygon.size());
  for (const double z : {0.0, height})
    for (const Imath::V2d& p : polygon) mesh.positions.emplace_back(p.x, p.y, z);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    mesh.triangles.push_back({i, j, n + j});
    mesh.triangles.push_back({i, n + j, n + i});
    if (i == 0 || j == 0) continue;
    mesh.triangles.push_back({0, j, i});
    mesh.triangles.push_back({n, n + i, n + j});
  }
  return mesh;
}

inline TriMesh cubeMesh() {
  return prism({{0, 0}, {1, 0}, {1, 1}, {0, 1}}, 1);
}

/// Profile of a bracket, with one concave edge. Its volume is 2.31 times the height.
inline TriMesh bracketMesh(double height = 1) {
  return prism({{0, 0}, {2, 0}, {2, 0.7}, {0.7, 0.7}, {0.7, 2}, {0, 2}}, height);
}

inline PointCloud pointsOf(const TriMesh& mesh, std::size_t count, std::uint64_t seed = 1) {
  PointCloud cloud = sampleMesh(mesh, {.count = count, .seed = seed});
  cloud.normals.clear();
  return cloud;
}

/// Cylinder of radius 1 about the z axis, from 0 to `height`.
inline PointCloud cylinder(std::size_t count, double height = 1.5) {
  std::vector<Imath::V2d> circle;
  constexpr int kSides = 180;
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSides;
    circle.emplace_back(std::cos(angle), std::sin(angle));
  }
  PointCloud cloud = pointsOf(prism(circle, height), count);
  for (V3d& p : cloud.positions)
    if (p.z > 0 && p.z < height) {
      const double radius = std::hypot(p.x, p.y);
      p = V3d(p.x / radius, p.y / radius, p.z);
    }
  return cloud;
}

/// Radius of a ball with a sharp edge that fades out: a groove or ridge in the plane z = 0, on the
/// side of positive x.
inline double fadingRadius(const V3d& direction) {
  const double x = std::max(0.0, direction.x);
  return 1 - 0.6 * x * x * std::abs(direction.z);
}
inline PointCloud fadingEdge(std::size_t count) {
  PointCloud cloud = projected_points::sphere(count);
  for (V3d& p : cloud.positions) p *= fadingRadius(p);
  return cloud;
}

/// Distance from the surface of the box from 0 to `size`.
inline double boxDistance(const V3d& p, const V3d& size) {
  const V3d half = size * 0.5, d = p - half;
  const V3d q(std::abs(d.x) - half.x, std::abs(d.y) - half.y, std::abs(d.z) - half.z);
  const V3d outside(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
  return std::abs(outside.length() + std::min(0.0, std::max({q.x, q.y, q.z})));
}

}  // namespace sharp_points
