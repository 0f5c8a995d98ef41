#pragma once

#include <Imath/ImathBox.h>

#include <cmath>
#include <limits>

#include "levelset/narrow_band.h"

namespace levelset {

/// A part of a band: all that somebody is going to look at.
struct BandPart {
  double halfWidth = std::numeric_limits<double>::infinity();  ///< voxels
  Imath::Box3d region = kEverywhere;                           ///< world

  [[nodiscard]] bool isAll() const { return std::isinf(halfWidth) && isEverywhere(region); }
};

/// A band that holds the part as it was, to the bit, and little beside it. Beyond the region it
/// may end anywhere, as if the solid were cut open there, and no sign is to be trusted.
/// @param part  a half width that is no narrower changes nothing
/// @throws UsageError for a half width below 1, or a region that is empty
[[nodiscard]] NarrowBand cropped(NarrowBand band, const BandPart& part);

}  // namespace levelset
