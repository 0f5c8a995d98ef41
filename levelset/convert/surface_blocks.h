#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "levelset/convert/prisms/prism_covering.h"
#include "levelset/mesh_sign/local_mesh.h"
#include "levelset/progress.h"

namespace levelset::convert {

/// Receives the lowest grid point of a block, in the frame of the LocalMesh, and the triangles that
/// may lie within `reach` of it, as ascending indices. Called from several threads at once.
using BlockVisitor =
    std::function<void(const Imath::V3i& origin, std::span<const std::uint32_t> candidates)>;

/// Returns false only if a triangle need not be measured from any point of the cube with the given
/// centre and half edge. Called from several threads at once.
using CellTest =
    std::function<bool(std::uint32_t triangle, const Imath::V3d& centre, double halfEdge)>;

/// Returns the test whether the prism of a triangle may touch a cell.
[[nodiscard]] CellTest prismTest(const LocalMesh& mesh, const PrismCovering& prisms);

/// Visits all 8³ blocks of grid points that may lie within `reach` voxels of the mesh. Descends an
/// octree from one root cell to the blocks. Each cell passes to a child the triangles that may lie
/// within `reach` of the child. Small triangles are tested by their bounding box, large ones also
/// by their distance.
/// @param region  lowest grid points of the first and the last block to visit; empty: all blocks
/// @param isNeeded  replaces the test of large triangles by their distance
void forEachBlock(const LocalMesh& mesh, double reach, const BlockVisitor& visit,
                  const Progress& progress, const std::optional<Imath::Box3i>& region = {},
                  const CellTest& isNeeded = {});

}  // namespace levelset::convert
