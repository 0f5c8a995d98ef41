#pragma once

#include <Imath/ImathVec.h>

#include <vector>

#include "levelset/mesh_sign/mesh_topology.h"

namespace levelset::convert {

/// A mesh in voxel units relative to an integer origin. Grid points have integer coordinates.
/// Coordinates stay small even if the object lies far from the world origin.
struct LocalMesh {
  std::vector<Imath::V3d> points;
  std::vector<Triangle> triangles;

  [[nodiscard]] const Imath::V3d& corner(std::size_t triangle, std::size_t i) const {
    return points[triangles[triangle][i]];
  }
};

}  // namespace levelset::convert
