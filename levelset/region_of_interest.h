#pragma once

#include <Imath/ImathBox.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/narrow_band.h"

namespace levelset {

/// Part of a band that the following operators read: a half width and a box. Only this part is
/// computed.
struct RegionOfInterest {
  /// Half width, voxels. Infinite: the complete band.
  double halfWidth = std::numeric_limits<double>::infinity();
  Imath::Box3d region = kEverywhere;  ///< box, world units

  [[nodiscard]] bool isWhole() const { return std::isinf(halfWidth) && isEverywhere(region); }

  /// Extends the region of interest to include that of a second consumer.
  void join(const RegionOfInterest& other) {
    halfWidth = std::max(halfWidth, other.halfWidth);
    region.extendBy(other.region);
  }
};

}  // namespace levelset
