#pragma once

#include <Imath/ImathVec.h>

#include <span>
#include <vector>

#include "levelset/mesh_sign/local_mesh.h"

namespace levelset::convert {

/// For each point, 1 when a triangle of the mesh lies within `reach` (voxels), else 0.
[[nodiscard]] std::vector<char> areNear(const LocalMesh& mesh, std::span<const Imath::V3d> points,
                                        double reach);

}  // namespace levelset::convert
