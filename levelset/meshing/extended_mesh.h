#pragma once

#include <cstddef>

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct ExtendedMeshOptions {
  /// Mesh from which the band was computed, world coordinates. Its intersections with the grid
  /// edges and its normals are used. Null: those of the field are used.
  const TriMesh* original = nullptr;
  Progress progress = {};
};

struct ExtendedMesh {
  TriMesh mesh;                      ///< in world coordinates
  std::size_t edgeVertices = 0;      ///< cells with a vertex on an edge of the solid
  std::size_t cornerVertices = 0;    ///< cells with a vertex at a corner of the solid
  std::size_t crossings = 0;         ///< grid edges that the surface crosses
  std::size_t missingCrossings = 0;  ///< crossed grid edges that miss the original mesh
};

/// Converts the zero set to a triangle mesh by extended marching cubes on directed distances
/// [Kobbelt01]. Cells with an edge or a corner get a vertex there; all others are those of
/// bandToMesh(). The mesh is closed, 2-manifold and faces outwards.
/// @throws InvalidInput if the band is empty or has no zero crossing or is an open surface, or the
///         original mesh has no triangles, has invalid vertices or indices, or is elsewhere
[[nodiscard]] ExtendedMesh bandToExtendedMesh(const NarrowBand& band,
                                              const ExtendedMeshOptions& options = {});

}  // namespace levelset
