#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/meshing/extended/directed_distances.h"
#include "levelset/progress.h"

namespace levelset {

struct ExtendedSurface : IndexMesh {
  std::size_t edgeVertices = 0;    ///< vertices on edges of the solid
  std::size_t cornerVertices = 0;  ///< vertices at its corners and peaks
  /// For each vertex: its number in EdgeCrossings::at, or kFeature for a vertex on an edge or at a
  /// corner of the solid. Empty unless it is asked for.
  std::vector<std::uint32_t> crossing;
  static constexpr std::uint32_t kFeature = 0xffffffffu;
};

/// Builds the mesh of extended marching cubes [Kobbelt01]. A polygon of a cell has a feature if
/// the normals at its crossings differ by more than 26°: an edge of the solid, or a corner if one
/// normal leaves the plane of the two that differ most by more than 44°. It becomes a fan of
/// triangles about the point that fits the tangent planes at its crossings best. All other polygons
/// are those of marchCells(). Mesh edges between two fans are then flipped where they cut across an
/// edge of the solid. The mesh is closed and 2-manifold, as the mesh of marchCells() is.
/// @param listsCrossings  true: set ExtendedSurface::crossing
/// @throws Cancelled
[[nodiscard]] ExtendedSurface extendedSurface(const CellSurface& surface,
                                              const EdgeCrossings& crossings,
                                              const Progress& progress,
                                              bool listsCrossings = false);

}  // namespace levelset
