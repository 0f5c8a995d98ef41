#pragma once

#include "levelset/fields/field.h"

namespace levelset {

/// A field that limits where, and how strongly, an operator acts.
struct Mask {
  ScalarField field;
  double min = 0;       ///< field value up to which the weight is 0
  double max = 1;       ///< field value from which on the weight is 1
  bool invert = false;  ///< replaces the weight by 1 − weight

  /// Weight of the operator at a point. 0: the surface stays unchanged; 1: the operator acts fully.
  /// Between min and max the weight is 3t² − 2t³ with t = (field − min) / (max − min). If min =
  /// max, it jumps from 0 to 1 there. For a NaN field value it is 0 before inversion.
  [[nodiscard]] double weight(const Imath::V3d& world) const;
};

/// Checks a mask.
/// @throws UsageError unless the field is set, min and max are finite and min ≤ max
void checkMask(const Mask& mask);

}  // namespace levelset
