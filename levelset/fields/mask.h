#pragma once

#include "levelset/fields/field.h"

namespace levelset {

/// Where an operator acts, and how strongly.
struct Mask {
  ScalarField field;
  double min = 0;  ///< field values from which on it acts …
  double max = 1;  ///< … and at which it acts fully
  bool invert = false;

  /// 0: the surface stays as it is, 1: the operator acts fully; 3t² − 2t³ between. With min = max
  /// a step. NaN in the field counts as 0 before inversion.
  [[nodiscard]] double weight(const Imath::V3d& world) const;
};

/// @throws UsageError unless field is set, min and max are finite and min ≤ max.
///         @param action  for the message
void checkMask(const Mask& mask, const char* action);

}  // namespace levelset
