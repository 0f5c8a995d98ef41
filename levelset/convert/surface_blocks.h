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

/// Receives the lowest grid point of a block and the triangles that may lie within reach of it, in
/// ascending order. Called from several threads at once.
using BlockVisitor =
    std::function<void(const Imath::V3i& origin, std::span<const std::uint32_t> candidates)>;

/// Visits all 8³ blocks of grid points that may lie within `reach` voxels of the mesh. Recursively
/// halves space from one root cell down to the blocks. Each cell passes on the triangles that may
/// reach its halves. Large triangles are tested by their distance, not by their bounding box.
/// @param region  if given: the lowest grid points of the first and the last block to visit
void forEachBlock(const LocalMesh& mesh, double reach, const BlockVisitor& visit,
                  const Progress& progress, const std::optional<Imath::Box3i>& region = {});

}  // namespace levelset::convert
