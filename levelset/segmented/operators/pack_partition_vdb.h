#pragma once

// Packing of partitions whose owners are known. Includes OpenVDB: for .cpp files only.

#include <cstdint>
#include <functional>
#include <vector>

#include "levelset/progress.h"
#include "levelset/segmented/segmented_data_vdb.h"

namespace levelset {

/// Block of a partition whose distances are not known yet.
struct OwnedBlock {
  openvdb::Coord block;  ///< index coordinates / 8
  /// Labels of the 512 voxels, z fastest; a single one if they are equal.
  std::vector<RegionLabel> owners;
  PackedBlock kept = {};  ///< with words: the block stays as it is

  [[nodiscard]] RegionLabel ownerAt(std::uint32_t voxel) const {
    return owners[owners.size() == 1 ? 0 : voxel];
  }
  [[nodiscard]] openvdb::Coord origin() const {
    return {block[0] << 3, block[1] << 3, block[2] << 3};
  }
  /// Replaces the owners by a single one if they are equal.
  void shorten();
};

/// Writes the distance of a voxel from the interface between its own region and each of `others`,
/// world units, ≥ 0.
/// @param block  number of the block
using DistancesTo =
    std::function<void(std::size_t block, std::uint32_t voxel, RegionLabel own,
                       const std::vector<RegionLabel>& others, std::vector<float>& distances)>;

/// Makes a field of owners and distances. A voxel gets the distances to the regions up to two grid
/// points away: the smallest one, and those to regions that are one grid point away.
/// @param tiles   SegmentedData::tile() of the label by block coordinate; values at the blocks are
///                ignored
/// @param blocks  by x, y, z: all blocks with several owners, or that are not more than two grid
///                points away from another owner
/// @param distances  called by several threads at once
/// @throws ResourceLimit, Cancelled
[[nodiscard]] SegmentedField packPartition(openvdb::math::Transform::Ptr transform,
                                           double halfWidth, openvdb::Int32Tree::Ptr tiles,
                                           std::vector<OwnedBlock> blocks,
                                           const DistancesTo& distances, const Progress& progress);

/// Copies a block out of a field.
[[nodiscard]] PackedBlock packedBlockOf(const SegmentedData& data, std::size_t block);

}  // namespace levelset
