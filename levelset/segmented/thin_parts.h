#pragma once

// Internal header of levelset: public headers must not include it.

#include <span>
#include <vector>

#include "levelset/segmented/segment_solids.h"

namespace levelset {

/// Part of a region between two neighbouring grid points that own neither of them.
struct LostPlace {
  RegionLabel label;
  double thickness;     ///< along the grid line, voxels
  Imath::V3d position;  ///< index coordinates
};

/// Finds the parts of regions that are thinner than a voxel along a grid line: at grid points, and
/// at the given places between them. A region also becomes thin where it ends at a junction; there
/// it is thicker two voxels away, and does not count.
/// @return one entry for each label with thin parts, ascending
[[nodiscard]] std::vector<ThinPart> thinParts(const SegmentedField& field,
                                              std::span<const LostPlace> lost);

}  // namespace levelset
