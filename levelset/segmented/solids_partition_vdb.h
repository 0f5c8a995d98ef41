#pragma once

// Partition of solids, for segmentSolids(). Includes OpenVDB: for .cpp files only.

#include <vector>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "levelset/segmented/segmented_data_vdb.h"
#include "levelset/segmented/thin_parts.h"

namespace levelset {

struct PartitionOfSolids {
  openvdb::Int32Tree::Ptr tiles;    ///< for assembleSegmented()
  std::vector<PackedBlock> blocks;  ///< by x, y, z
  std::vector<LostPlace> lost;      ///< visible parts of solids between grid points
};

/// Partitions solids on one grid, with equal backgrounds. The last solid that contains a point owns
/// it, so the interface between two regions lies on the surface of the later solid.
/// @param labels     of the solids
/// @param halfWidth  of the field, voxels
/// @param gap        largest gap between solids that counts as contact, voxels
[[nodiscard]] PartitionOfSolids partitionSolids(const std::vector<NarrowBand>& solids,
                                                const std::vector<RegionLabel>& labels,
                                                double halfWidth, double gap,
                                                const Progress& progress);

}  // namespace levelset
