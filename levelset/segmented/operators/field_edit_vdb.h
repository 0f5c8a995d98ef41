#pragma once

// Local changes of a segmented field. Includes OpenVDB: for .cpp files only.

#include <algorithm>
#include <cstddef>
#include <functional>
#include <string_view>
#include <vector>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "levelset/segmented/segmented_data_vdb.h"

namespace levelset {

/// Space that changes its region: the inside of a band, or with `sign` −1 its outside.
struct EditedSpace {
  const openvdb::FloatTree* tree = nullptr;
  float sign = 1;
  RegionLabel label = kVoid;  ///< new label
  /// Labels of the regions that it takes from, ascending. Not `label`.
  std::vector<RegionLabel> over = {};
  float gap = 0;  ///< largest distance over which it takes void up to another region, world units
  std::size_t maxMemory = kNoMemoryLimit;

  [[nodiscard]] bool takes(RegionLabel from) const {
    return std::binary_search(over.begin(), over.end(), from);
  }
};

/// Gives a space to a region. Blocks that the band does not reach keep their bits.
/// @throws NoSurface if no region is left
/// @throws ResourceLimit, Cancelled
[[nodiscard]] SegmentedField editSpace(const SegmentedField& field, const EditedSpace& space,
                                       const Progress& progress);

/// Brings a solid to the grid of a field, with a half width of at least three voxels.
[[nodiscard]] NarrowBand onGridOfField(const SegmentedField& field, const NarrowBand& solid,
                                       std::size_t maxMemory);

/// Signed distance of a grid point to a region, as stored: the half width where none is.
[[nodiscard]] inline float storedDistance(SegmentedReader& reader, const openvdb::Coord& at,
                                          const SegmentedReader::Nearest& near,
                                          RegionLabel region) {
  return near.label == region ? -near.distance : reader.distanceTo(at, near, region);
}

/// Copies the tiles of a field, with new labels.
[[nodiscard]] openvdb::Int32Tree::Ptr copyTiles(
    const SegmentedData& data, const std::function<RegionLabel(RegionLabel)>& labelOf);

/// @throws NoSurface if a field has no regions
void requireRegion(const SegmentedField& field);

/// @throws InvalidInput for a field with sheets, which operators of regions would lose
void requireNoSheets(const SegmentedField& field);

/// Checks labels against those of a field; the void counts as one.
/// @throws UsageError for a label that the field does not have
void requireLabels(const SegmentedField& field, const std::vector<RegionLabel>& labels);

}  // namespace levelset
