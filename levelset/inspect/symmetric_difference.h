#pragma once

// For the .cpp files of levelset/inspect only.

#include "levelset/vdb.h"

namespace levelset {

/// Volume, in voxels, of the points that lie inside (negative) exactly one of two fields on the
/// same grid points. Each cell is split into tetrahedra with linear fields.
[[nodiscard]] double symmetricDifference(const openvdb::FloatTree& a, const openvdb::FloatTree& b);

}  // namespace levelset
