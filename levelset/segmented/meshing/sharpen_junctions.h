#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/segmented/meshing/segmented_to_mesh.h"

namespace levelset {

/// Moves the vertices of junctions to the curves and points where the interfaces meet. Then spaces
/// them evenly along the curves, and the vertices beside them along the interfaces, so that
/// triangles do not fold.
/// @param isDoubtful  true for vertices whose crossing was not found from distances to their own
///                    interface
/// @param mesh        positions in index coordinates
void sharpenJunctions(const SegmentedData& data, const std::vector<char>& isDoubtful,
                      SegmentedMesh& mesh, const Progress& progress);

}  // namespace levelset
