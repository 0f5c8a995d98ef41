#pragma once

#include "levelset/narrow_band.h"
#include "levelset/region_of_interest.h"

namespace levelset {

/// Crops a band to a region of interest. Values in the region keep their bits; a few blocks around
/// it may stay. Outside the region, the band may end anywhere and its signs are undefined.
/// @param part  a half width of at least that of the band does not narrow the band
/// @throws UsageError if the half width is below 1 or the region is empty
[[nodiscard]] NarrowBand cropped(NarrowBand band, const RegionOfInterest& part);

}  // namespace levelset
