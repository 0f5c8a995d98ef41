#pragma once

#include <functional>
#include <optional>

#include "apps/pipeline/values/value.h"
#include "levelset/operator/cost.h"

namespace pipeline {

class Invocation;

using levelset::Cost;

/// Estimates the cost of an action. Operands are plans of the parts that are read, and
/// Invocation::planned is the plan of the part that is made. Empty where the cost is not known.
using CostOf = std::function<std::optional<Cost>(Invocation&)>;

/// Cost in proportion to the active voxels of the operands together or of the result, whichever are
/// more.
/// @param nanoseconds,bytes  for each active voxel
/// @param perTriangle  nanoseconds for each triangle of a mesh; 0: the cost of meshes is not known
[[nodiscard]] CostOf costPerVoxel(double nanoseconds, double bytes = 0, double perTriangle = 0);

}  // namespace pipeline
