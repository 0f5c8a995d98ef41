#pragma once

#include "levelset/convert/cell_surface.h"

namespace levelset {

/// The zero set in index space with the edges and corners that the field implies: one vertex for
/// each polygon of a cell, one quadrilateral for each crossed edge [Ju02, Nie04]. Closed and
/// 2-manifold as the uniform mesh is.
[[nodiscard]] IndexMesh sharpSurface(const CellSurface& surface, const openvdb::FloatGrid& grid);

}  // namespace levelset
