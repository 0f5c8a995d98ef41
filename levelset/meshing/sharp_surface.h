#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/meshing/sharp_features.h"

namespace levelset {

/// A mesh in index space, and the sheets of the surface that meet at each of its vertices.
struct SharpMesh : IndexMesh {
  std::vector<VertexSheets> sheets;  ///< by vertex
};

/// The zero set in index space with the edges and corners that the field implies: one vertex for
/// each polygon of a cell, one quadrilateral for each crossed edge [Ju02, Nie04], and the vertices
/// that edges and corners between the cells need (sharp_features.h). Closed and 2-manifold as the
/// uniform mesh is.
/// @throws Cancelled
[[nodiscard]] SharpMesh sharpSurface(const CellSurface& surface, const openvdb::FloatGrid& grid,
                                     const Progress& progress);

}  // namespace levelset
