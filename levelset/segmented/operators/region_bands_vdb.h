#pragma once

// Signed distances to the regions of a partition. Includes OpenVDB: for .cpp files only.

#include <cstddef>
#include <vector>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "levelset/segmented/segmented_data_vdb.h"

namespace levelset {

/// Signed distances to all regions of a partition, on one grid.
struct RegionBands {
  std::vector<RegionLabel> labels;  ///< ascending, the void first
  /// One for each label. That of the void is negative outside it: a band is bounded inside, and the
  /// void has no bounds.
  std::vector<NarrowBand> bands;

  /// Factor of the values of a band: that of the void has the opposite sign.
  [[nodiscard]] float sign(std::size_t region) const {
    return labels[region] == kVoid ? -1.0f : 1.0f;
  }
};

/// Makes a band of the stored distances to a region: ± the half width of the field where none is
/// stored. For the void see RegionBands.
[[nodiscard]] NarrowBand storedBand(const SegmentedField& field, RegionLabel region);

/// As storedBand(), for several regions together. With the void among them, for the others.
/// @param regions  ascending
[[nodiscard]] NarrowBand storedBandOfAll(const SegmentedField& field,
                                         const std::vector<RegionLabel>& regions);

/// Computes the distances to all regions of a field.
/// @param halfWidth  voxels
/// @throws ResourceLimit, Cancelled
[[nodiscard]] RegionBands regionBands(const SegmentedField& field, double halfWidth,
                                      std::size_t maxMemory, const Progress& progress);

/// Makes a field of the distances to its regions. A grid point belongs to the region with the least
/// value.
/// @param bands      a half width of at least 2 voxels; they may overlap, or leave gaps, by less
///                   than that
/// @param halfWidth  of the field, voxels
/// @throws ResourceLimit, Cancelled
[[nodiscard]] SegmentedField fieldOfBands(const RegionBands& bands, double halfWidth,
                                          const Progress& progress);

/// Leaf of a region.
struct LabelledLeaf {
  openvdb::Coord block;  ///< index coordinates / 8
  std::size_t region;    ///< number in RegionBands
  const openvdb::FloatTree::LeafNodeType* leaf;
};
/// Lists the leaves of all bands by block, then by region.
[[nodiscard]] std::vector<LabelledLeaf> labelledLeaves(const RegionBands& bands);
/// Returns the number of the first leaf of each block, and then the count of all leaves.
[[nodiscard]] std::vector<std::size_t> firstLeaves(const std::vector<LabelledLeaf>& leaves);

}  // namespace levelset
