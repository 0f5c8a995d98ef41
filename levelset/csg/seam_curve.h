#pragma once

// For the .cpp files of levelset/csg only.

#include <vector>

#include "levelset/vdb.h"

namespace levelset::solids {

/// Finds points on the curve in which the zero sets of two fields intersect, about one per voxel.
/// Both fields have the same transform. In each cell of eight grid points that both zero sets
/// cross, fits a linear model to each field. Both models are zero on a line. Its point nearest to
/// the centre of the cell is taken, if it lies in or near the cell [Brodersen07 §6.3]. Nearly
/// parallel surfaces give no points.
/// @return index coordinates, in tree order
[[nodiscard]] std::vector<openvdb::Vec3d> seamCurve(const openvdb::FloatTree& a,
                                                    const openvdb::FloatTree& b);

}  // namespace levelset::solids
