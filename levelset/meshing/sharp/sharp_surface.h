#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/meshing/sharp/sharp_features.h"

namespace levelset {

/// Mesh in index space, with the sheets of the surface that meet at each of its vertices.
struct SharpMesh : IndexMesh {
  std::vector<VertexSheets> sheets;  ///< one for each vertex
};

/// Meshes the zero set in index space with the edges and corners that the field implies. The mesh
/// has one vertex for each polygon of a cell and one quadrilateral for each crossed edge [Ju02,
/// Nie04]. Vertices are added for edges and corners between the cells (sharp_features.h). The mesh
/// is closed and 2-manifold, as the mesh of marchCells() is.
/// @throws Cancelled
[[nodiscard]] SharpMesh sharpSurface(const CellSurface& surface, const openvdb::FloatGrid& grid,
                                     const Progress& progress);

}  // namespace levelset
