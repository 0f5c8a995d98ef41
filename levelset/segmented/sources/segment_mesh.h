#pragma once

#include <cstddef>
#include <vector>

#include "levelset/mesh.h"
#include "levelset/progress.h"
#include "levelset/segmented/segment_solids.h"
#include "levelset/segmented/segmented_field.h"

namespace levelset {

struct SegmentMeshOptions {
  double halfWidth = 2;  ///< half width of the field, voxels, from 2 to 8
  /// Keeps sheets: surfaces with the same region on both sides, such as a wall with a door. Without
  /// it a mesh that holds one is refused, because most of them are closed surfaces with a defect.
  bool keepsSheets = false;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct SegmentMeshResult {
  SegmentedField field;
  std::size_t patches = 0;  ///< parts of the mesh between junction edges
  // With SegmentMeshOptions::keepsSheets:
  std::size_t rimEdges = 0;           ///< edges of the mesh with one triangle
  std::size_t crossingTriangles = 0;  ///< triangles that cross others without sharing an edge
  /// Parts of regions between surfaces that are nearly parallel and less than a voxel apart, by
  /// label. Where no grid point lies between them (isLost), they become one sheet or interface.
  std::vector<ThinPart> thinParts;
};

/// Makes a segmented field of a mesh whose triangles separate regions, for example a sphere with a
/// diaphragm or a box with walls [Yamazaki02]. Three or more triangles may share an edge. Regions
/// are the connected parts of space that no triangle crosses; they are numbered by decreasing
/// volume from 1, and the outside is the void. The mesh is cut into patches at edges that not
/// exactly two triangles share. Two grid points belong to one region when the line between them
/// does not intersect the mesh, or when both are closest to the same side of a patch.
///
/// With `keepsSheets` the mesh may have borders, cross itself and be non-orientable. Then the field
/// also stores which edges of the grid the mesh crosses (an exact test), and where. The published
/// rule counts a crossing when the distances of both grid points add up to less than a voxel; that
/// moves the rim by a fraction of a voxel. An edge between grid points of one region that is
/// crossed twice counts only if no other way leads from one to the other nearby: a line may cut off
/// the edge of a solid. Two surfaces that no grid point separates become one.
/// @param mesh  finite coordinates; parts that meet share vertices at equal positions; the
///        orientation of the triangles does not matter
/// @param voxelSize  world units; grid points lie at its integer multiples
/// @throws UsageError for a voxel size or half width out of range
/// @throws InvalidInput without `keepsSheets` when a patch has the same region on both sides,
///         because the mesh has a hole, a border, or parts that cross without sharing edges; for a
///         mesh that meshToBand() refuses because of its coordinates
/// @throws ResourceLimit when the memory does not suffice, or there are more than 65535 regions
/// @throws Cancelled
[[nodiscard]] SegmentMeshResult segmentMesh(const TriMesh& mesh, double voxelSize,
                                            const SegmentMeshOptions& options = {});

}  // namespace levelset
