#pragma once

#include "levelset/narrow_band.h"
#include "levelset/region_of_interest.h"

namespace levelset {

/// A band that holds the part as it was, to the bit, and little beside it. Beyond the region it
/// may end anywhere, as if the solid were cut open there, and no sign is to be trusted.
/// @param part  a half width that is no narrower changes nothing
/// @throws UsageError for a half width below 1, or a region that is empty
[[nodiscard]] NarrowBand cropped(NarrowBand band, const RegionOfInterest& part);

}  // namespace levelset
