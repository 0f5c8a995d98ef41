#include "levelset/operator/cost.h"

#include <algorithm>

namespace levelset {

Cost& Cost::operator+=(const Cost& next) {
  seconds += next.seconds;
  bytes = std::max(bytes, next.bytes);
  return *this;
}

Cost costPerVoxel(const OperatorPlans& plans, double nanoseconds, double bytes) {
  double read = 0;
  for (const ValuePlan& operand : plans.operands) read += operand.activeVoxels();
  const double voxels = std::max(read, plans.result.activeVoxels());
  return {1e-9 * nanoseconds * voxels, bytes * voxels};
}

}  // namespace levelset
