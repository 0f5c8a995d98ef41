#pragma once

// Internal header of levelset: public headers must not include it.

#include <cmath>

#include "levelset/terrain/height_field.h"

namespace levelset::terrain {

/// Heights at the corners of a cell. The diagonal of the two triangles runs from `lowLow` to
/// `highHigh`; the first word tells the side along x, the second that along y.
struct GroundCell {
  double lowLow, highLow, lowHigh, highHigh;

  GroundCell(const HeightField& field, int column, int row)
      : lowLow(static_cast<double>(field.at(column, row))),
        highLow(static_cast<double>(field.at(column + 1, row))),
        lowHigh(static_cast<double>(field.at(column, row + 1))),
        highHigh(static_cast<double>(field.at(column + 1, row + 1))) {}

  // The sum of heights with a NaN is NaN.
  [[nodiscard]] bool hasLower() const { return !std::isnan(lowLow + highLow + highHigh); }
  [[nodiscard]] bool hasUpper() const { return !std::isnan(lowLow + lowHigh + highHigh); }
  [[nodiscard]] bool isComplete() const { return hasLower() && !std::isnan(lowHigh); }
};

}  // namespace levelset::terrain
