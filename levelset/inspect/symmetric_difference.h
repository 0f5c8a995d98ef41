#pragma once

// For the .cpp files of levelset/inspect only.

#include "levelset/vdb.h"

namespace levelset {

/// Volume, in voxels, of the points that are inside one of two fields only. Both on the same grid
/// points; each cell is cut into tetrahedra on which the fields are linear.
[[nodiscard]] double symmetricDifference(const openvdb::FloatTree& a, const openvdb::FloatTree& b);

}  // namespace levelset
