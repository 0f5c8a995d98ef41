#pragma once

#include "levelset/fields/field.h"

namespace levelset {

/// A field that limits where, and how strongly, an operator acts.
struct Mask {
  ScalarField field;
  double min = 0;  ///< field value at which the operator begins to act
  double max = 1;  ///< field value from which on it acts fully
  bool invert = false;

  /// Weight of the operator at a point. 0: the surface stays unchanged; 1: the operator acts fully;
  /// 3t² − 2t³ between. A step if min = max. NaN in the field counts as 0 before inversion.
  [[nodiscard]] double weight(const Imath::V3d& world) const;
};

/// Checks a mask.
/// @throws UsageError unless the field is set, min and max are finite and min ≤ max
void checkMask(const Mask& mask);

}  // namespace levelset
