#pragma once

#include "levelset/meshing/cell_surface.h"

namespace levelset {

/// Coarsens a closed mesh where it is flat. Vertices that remain keep their places; the planes of
/// all triangles that went into one stay within `tolerance` of it [Gar97]. Closed and 2-manifold as
/// before.
[[nodiscard]] IndexMesh decimate(const IndexMesh& mesh, double tolerance);

}  // namespace levelset
