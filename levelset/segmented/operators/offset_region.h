#pragma once

#include <cstddef>

#include "levelset/progress.h"
#include "levelset/segmented/segmented_field.h"

namespace levelset {

/// Regions at whose cost another one grows, or that get the space when it shrinks.
enum class OffsetCost {
  Neighbours,  ///< all regions and the void; freed points go to the nearest of them
  Void         ///< the void only
};

struct OffsetRegionOptions {
  OffsetCost cost = OffsetCost::Neighbours;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Moves the boundary of a region outwards by a distance, exactly as offset() moves a solid. A
/// negative distance shrinks the region. Other interfaces stay, and blocks of 8³ grid points away
/// from the region keep their bits. Where a shrinking region frees space for several neighbours,
/// their new interface has equal distances to them. A region that shrinks to nothing disappears.
/// @param label     a region of the field
/// @param distance  world units, any sign
/// @throws UsageError for label 0, a label that the field does not have, or a distance that is not
///         finite
/// @throws NoSurface if no region is left
/// @throws ResourceLimit, Cancelled
[[nodiscard]] SegmentedField offsetRegion(const SegmentedField& field, RegionLabel label,
                                          double distance, const OffsetRegionOptions& options = {});

}  // namespace levelset
