#pragma once

#include "levelset/narrow_band.h"
#include "levelset/region_of_interest.h"

namespace levelset {

/// Crops a band to a region of interest. Values in the region keep their bits. Some blocks around
/// the region may stay, since only complete blocks are removed. Outside the region, the band may
/// end anywhere and its signs are undefined. An open surface stays one.
/// @param part  box and half width to keep; the band is narrowed if its half width is larger
/// @throws UsageError if the half width is below 1 or the region is empty
[[nodiscard]] NarrowBand cropped(NarrowBand band, const RegionOfInterest& part);

}  // namespace levelset
