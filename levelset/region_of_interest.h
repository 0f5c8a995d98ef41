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

}  // namespace levelset
