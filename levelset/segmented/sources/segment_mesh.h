#pragma once

#include <cstddef>

#include "levelset/mesh.h"
#include "levelset/progress.h"
#include "levelset/segmented/segmented_field.h"

namespace levelset {

struct SegmentMeshOptions {
  double halfWidth = 2;  ///< half width of the field, voxels, from 2 to 8
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct SegmentMeshResult {
  SegmentedField field;
  std::size_t patches = 0;  ///< parts of the mesh between junction edges
};

/// Makes a segmented field of a mesh whose triangles separate regions, for example a sphere with a
/// diaphragm or a box with walls [Yamazaki02]. Three or more triangles may share an edge. Regions
/// are the connected parts of space that no triangle crosses; they are numbered by decreasing
/// volume from 1, and the outside is the void. The mesh is cut into patches at edges that not
/// exactly two triangles share. Two grid points belong to one region when the line between them
/// does not intersect the mesh, or when both are closest to the same side of a patch.
/// @param mesh  finite coordinates; parts that meet share vertices at equal positions; orientations
/// do
///              not matter
/// @param voxelSize  world units; grid points lie at its integer multiples
/// @throws UsageError for a voxel size or half width out of range
/// @throws InvalidInput when a patch has the same region on both sides, because the mesh has a
/// hole,
///         a border, or parts that cross without sharing edges; for a mesh that meshToBand()
///         refuses because of its coordinates
/// @throws ResourceLimit when the memory does not suffice, or there are more than 65535 regions
/// @throws Cancelled
[[nodiscard]] SegmentMeshResult segmentMesh(const TriMesh& mesh, double voxelSize,
                                            const SegmentMeshOptions& options = {});

}  // namespace levelset
