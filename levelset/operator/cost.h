#pragma once

#include "levelset/operator/description.h"

/// Estimates of the time and memory of an operator, fitted to measurements on solids of some
/// million voxels. tests/bench/step_costs.py repeats the measurements and compares.
namespace levelset {

struct Cost {
  double seconds = 0;  ///< CPU time
  double bytes = 0;    ///< peak memory in addition to operands and result

  /// Adds the cost of a later stage: times add up, of the two peak memories the larger one counts.
  Cost& operator+=(const Cost& next);
};

/// Cost in proportion to the active voxels of the operands together or of the result, whichever are
/// more.
/// @param nanoseconds  CPU time for each active voxel
/// @param bytes        memory for each active voxel, bytes
[[nodiscard]] Cost costPerVoxel(const OperatorPlans& plans, double nanoseconds, double bytes = 0);

}  // namespace levelset
