#pragma once

// Points and normals of a surface on the edges of a grid. Internal header of levelset: public
// headers must not include it.

#include <vector>

#include "levelset/mesh.h"
#include "levelset/meshing/cells/cell_surface.h"

namespace levelset {

/// Point in which a grid edge passes the surface, in index space, and the outward unit normal
/// there. The distance from an end of the edge to this point is a directed distance [Kobbelt01].
struct EdgeCrossing {
  openvdb::Vec3d point;
  openvdb::Vec3d normal;
};

struct EdgeCrossings {
  std::vector<EdgeCrossing> at;  ///< one for each crossed edge, by vertex number of CellSurface
  std::size_t fromField = 0;     ///< number of crossed edges that miss the original mesh
};

/// Computes the crossings of all crossed edges from the field. Beside an edge of the solid, the
/// interpolant would mix both faces. There the tangent plane of an end of the grid edge decides.
[[nodiscard]] EdgeCrossings crossingsOfField(const CellSurface& surface,
                                             const openvdb::FloatGrid& grid);

/// Intersects all crossed edges with the mesh from which the field was computed. Where an edge
/// meets several triangles, the intersection nearest to the zero of the field counts. An edge that
/// meets none has its crossing from the field.
/// @param original  mesh in world coordinates
/// @throws InvalidInput if the mesh has no triangles, a vertex that is not finite or an invalid
///         index, or meets none of the edges
[[nodiscard]] EdgeCrossings crossingsOfMesh(const CellSurface& surface,
                                            const openvdb::FloatGrid& grid,
                                            const TriMesh& original);

}  // namespace levelset
