#pragma once

#include <cstddef>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "levelset/segmented/segmented_field.h"

namespace levelset {

struct ExtractLabelOptions {
  double halfWidth = 3;  ///< half width of the band, voxels, at least 1
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Returns a region as a solid with signed distances, on the grid of the field.
/// @throws UsageError for the void, or a half width below 1
/// @throws NoSurface when the region owns no grid point
/// @throws ResourceLimit, Cancelled
[[nodiscard]] NarrowBand extractLabel(const SegmentedField& field, RegionLabel region,
                                      const ExtractLabelOptions& options = {});

}  // namespace levelset
