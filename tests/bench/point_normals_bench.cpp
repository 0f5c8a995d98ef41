// Compares the normals of a point cloud with those of the mesh whose vertices the points are.
//
//   point_normals_bench MESH
//
// The normal of the mesh at a vertex is the sum of the normals of its triangles, weighted by area.
// Prints the share of the points whose normal lies on the side of that of the mesh, and the angle
// between the two lines.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "levelset/error.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/points/processing/normals.h"

int main(int argc, char** argv) try {
  if (argc != 2) {
    fmt::print(stderr, "usage: point_normals_bench MESH\n");
    return 2;
  }
  const levelset::TriMesh mesh = levelset::readMesh(argv[1]);
  std::vector<Imath::V3d> ofMesh(mesh.positions.size(), Imath::V3d(0));
  for (const auto& t : mesh.triangles) {
    const Imath::V3d &a = mesh.positions[t[0]], &b = mesh.positions[t[1]],
                     &c = mesh.positions[t[2]];
    for (const auto v : t) ofMesh[v] += (b - a).cross(c - a);
  }
  levelset::PointCloud cloud;
  cloud.positions = mesh.positions;
  const auto normals = levelset::estimateNormals(cloud).cloud.normals;
  std::vector<double> angles;
  double sum = 0;
  std::size_t sameSide = 0;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Imath::V3d n(normals[i]);
    const double along = n.dot(ofMesh[i]);
    if (along == 0) continue;  // no normal
    sameSide += along > 0;
    angles.push_back(std::atan2(n.cross(ofMesh[i]).length(), std::abs(along)) * 180 /
                     std::numbers::pi);
    sum += angles.back();
  }
  if (angles.empty()) {
    fmt::print(stderr, "no point has a normal\n");
    return 1;
  }
  const auto middle = angles.begin() + static_cast<std::ptrdiff_t>(angles.size() / 2);
  std::nth_element(angles.begin(), middle, angles.end());
  const auto count = static_cast<double>(angles.size());
  fmt::print(
      "{} points: {:.2f} % on the side of the mesh; angle: median {:.2f}, mean {:.2f} degrees\n",
      angles.size(), 100 * static_cast<double>(sameSide) / count, *middle, sum / count);
} catch (const levelset::Error& error) {
  fmt::print(stderr, "{}\n", error.what());
  return 1;
}
