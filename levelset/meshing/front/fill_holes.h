#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstdint>
#include <vector>

#include "levelset/meshing/front/advancing_front.h"
#include "levelset/meshing/front/front_surface.h"

namespace levelset {

/// Fills the holes of a mesh. Where a hole has no triangulation, the triangles around it are
/// removed first, up to three rings. Sets `isClosed` and `filled`. May leave vertices without
/// triangles.
/// @param loops  vertices around each hole; the hole lies to the left of each edge
void fillHoles(const FrontSurface& surface, const std::vector<std::vector<std::uint32_t>>& loops,
               FrontMesh& mesh);

}  // namespace levelset
