#pragma once

#include <Imath/ImathVec.h>

#include <vector>

#include "levelset/mesh_sign/mesh_topology.h"

namespace levelset::convert {

/// A mesh in voxels about an integer origin: grid points have integer coordinates, and numbers stay
/// small however far from the world's origin the object lies.
struct LocalMesh {
  std::vector<Imath::V3d> points;
  std::vector<Triangle> triangles;

  [[nodiscard]] const Imath::V3d& corner(std::size_t triangle, std::size_t i) const {
    return points[triangles[triangle][i]];
  }
};

}  // namespace levelset::convert
