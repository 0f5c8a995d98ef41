#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/segmented/segmented_to_mesh.h"

namespace levelset {

/// Moves the vertices of junctions to the curves and points where the interfaces meet. Then spaces
/// them evenly along the curves, and the vertices beside them along the interfaces, so that
/// triangles do not fold.
/// @param mesh  positions in index coordinates
void sharpenJunctions(const SegmentedData& data, SegmentedMesh& mesh, const Progress& progress);

}  // namespace levelset
