#pragma once

// Steps that all methods of meshing share. Internal header of levelset: public headers must not
// include it.

#include "levelset/mesh.h"
#include "levelset/meshing/cells/cell_surface.h"
#include "levelset/narrow_band.h"

namespace levelset {

/// Collects the cells of a band's surface.
/// @param openSurface  accepts the band of an open surface
/// @throws InvalidInput if the band is empty or has no zero crossing, or is an open surface without
///         `openSurface`
[[nodiscard]] CellSurface cellsOf(const NarrowBand& band, bool openSurface);

/// Moves a mesh from the index space of a band to world coordinates.
[[nodiscard]] TriMesh toWorld(IndexMesh mesh, const NarrowBand& band);

}  // namespace levelset
