#pragma once

#include "levelset/operator/description.h"

/// Estimates of what an operator takes, measured on solids of some million voxels.
/// tests/bench/step_costs.py repeats the measurement and compares.
namespace levelset {

struct Cost {
  double seconds = 0;  ///< CPU time
  double bytes = 0;    ///< memory in use at once, beside operands and result

  /// Adds the cost of a later stage: times add up, the larger memory counts.
  Cost& operator+=(const Cost& next);
};

/// Cost in proportion to the active voxels of the operands together or of the result, whichever are
/// more.
/// @param nanoseconds,bytes  for each active voxel
[[nodiscard]] Cost costPerVoxel(const OperatorPlans& plans, double nanoseconds, double bytes = 0);

}  // namespace levelset
