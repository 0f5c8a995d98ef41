#pragma once

// For the .cpp files of levelset/solids only.

#include <vector>

#include "levelset/vdb.h"

namespace levelset::solids {

/// Points of the curve in which the zero sets of two fields on the same grid points meet, about one
/// a voxel: from each cell that both cross, the point where both linear models vanish, if it lies
/// in or beside the cell [Brodersen07 §6.3]. Surfaces that run along each other meet in no curve.
/// Index space, in tree order.
[[nodiscard]] std::vector<openvdb::Vec3d> seamCurve(const openvdb::FloatTree& a,
                                                    const openvdb::FloatTree& b);

}  // namespace levelset::solids
