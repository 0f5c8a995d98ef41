#pragma once

#include "levelset/meshing/cells/cell_surface.h"

namespace levelset {

/// Coarsens a closed mesh where it is flat, by edge collapses. Vertices that remain do not move.
/// Each lies within `tolerance` (voxels) of the planes of all triangles of the vertices that were
/// merged into it [Gar97]. The mesh remains closed and 2-manifold.
[[nodiscard]] IndexMesh decimate(const IndexMesh& mesh, double tolerance);

}  // namespace levelset
