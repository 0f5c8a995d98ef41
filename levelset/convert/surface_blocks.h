#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "levelset/mesh_sign/local_mesh.h"
#include "levelset/progress.h"

namespace levelset::convert {

/// Called with a block's lowest grid point and the triangles that may come within reach of it, in
/// ascending order; from many threads at once.
using BlockVisitor =
    std::function<void(const Imath::V3i& origin, std::span<const std::uint32_t> candidates)>;

/// Visits every 8³ block of grid points that may lie within `reach` voxels of the mesh. Space is
/// halved from one cell down to the blocks, each cell passing on the triangles that reach its
/// parts; large triangles are judged by their distance, not by their box.
/// @param region  if any: the lowest grid point of the first block that is visited, and of the last
void forEachBlock(const LocalMesh& mesh, double reach, const BlockVisitor& visit,
                  const Progress& progress, const std::optional<Imath::Box3i>& region = {});

}  // namespace levelset::convert
