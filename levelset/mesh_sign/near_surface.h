#pragma once

#include <Imath/ImathVec.h>

#include <span>
#include <vector>

#include "levelset/mesh_sign/local_mesh.h"

namespace levelset::convert {

/// For each point: is a triangle of the mesh no farther than `reach` (voxels)?
[[nodiscard]] std::vector<char> areNear(const LocalMesh& mesh, std::span<const Imath::V3d> points,
                                        double reach);

}  // namespace levelset::convert
