#pragma once

#include <cmath>
#include <random>

#include "levelset/points/processing/sample_mesh.h"
#include "tests/support/meshes.h"

/// Clouds for the projection and for meshes of points.
namespace projected_points {

using Imath::V3d;
using levelset::PointCloud;

/// Even points of a sphere of radius 1, without normals.
inline PointCloud sphere(std::size_t count) {
  PointCloud cloud = sampleMesh(support::sphereMesh(1, V3d(0), 48), {.count = count});
  for (V3d& p : cloud.positions) p.normalize();
  cloud.normals.clear();
  return cloud;
}

inline V3d torusNormal(const V3d& p) {
  return (p - V3d(p.x, p.y, 0).normalized()).normalized();
}
inline double torusDistance(const V3d& p) {
  return std::abs((p - V3d(p.x, p.y, 0).normalized()).length() - 0.4);
}

/// Even points of a torus of radius 1 with a tube of radius 0.4.
inline PointCloud torus(std::size_t count) {
  PointCloud cloud = sampleMesh(support::torusMesh(1, 0.4, 192, 96), {.count = count});
  for (V3d& p : cloud.positions) p = V3d(p.x, p.y, 0).normalized() + 0.4 * torusNormal(p);
  cloud.normals.clear();
  return cloud;
}

/// Half of a sphere of radius 1, z ≥ 0, with points on its rim.
inline PointCloud hemisphere(std::size_t count) {
  PointCloud cloud;
  const double spacing = std::sqrt(4 * M_PI / std::sqrt(3.0) / static_cast<double>(count));
  for (const V3d& p : sphere(2 * count).positions)
    if (p.z > 0.5 * spacing) cloud.positions.push_back(p);
  const auto rim = static_cast<std::size_t>(std::lround(2 * M_PI / spacing));
  for (std::size_t i = 0; i < rim; ++i) {
    const double angle = 2 * M_PI * static_cast<double>(i) / static_cast<double>(rim);
    cloud.positions.emplace_back(std::cos(angle), std::sin(angle), 0);
  }
  return cloud;
}

/// Square [0, 1]² in the plane z = 0, with points on its edges.
inline PointCloud square(int side) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> jitter(-0.2, 0.2);
  PointCloud cloud;
  for (int i = 0; i <= side; ++i)
    for (int j = 0; j <= side; ++j) {
      const bool isInX = i > 0 && i<side, isInY = j> 0 && j < side;
      cloud.positions.emplace_back((i + (isInX ? jitter(random) : 0)) / side,
                                   (j + (isInY ? jitter(random) : 0)) / side, 0);
    }
  return cloud;
}

inline void addNoise(PointCloud& cloud, double deviation) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal(0, deviation);
  for (V3d& p : cloud.positions) {
    const double x = normal(random), y = normal(random), z = normal(random);
    p += V3d(x, y, z);
  }
}

/// Distance of neighbours in a hexagonal lattice of the points on an area.
inline double hexagonalSpacing(double area, std::size_t count) {
  return std::sqrt(2 / std::sqrt(3.0) * area / static_cast<double>(count));
}

}  // namespace projected_points
