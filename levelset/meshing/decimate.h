#pragma once

#include "levelset/meshing/cell_surface.h"

namespace levelset {

/// Coarsens a closed mesh where it is flat. Vertices that remain do not move. Each stays within
/// `tolerance` of the planes of all triangles merged into it [Gar97]. The mesh remains closed and
/// 2-manifold.
[[nodiscard]] IndexMesh decimate(const IndexMesh& mesh, double tolerance);

}  // namespace levelset
