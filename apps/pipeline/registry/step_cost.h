#pragma once

#include <functional>
#include <optional>

#include "apps/pipeline/values/value.h"
#include "levelset/operator/cost.h"

namespace pipeline {

class Invocation;

using levelset::Cost;

/// Estimates the cost of an action. The operands are plans of the parts that are read, and
/// Invocation::planned is the plan of the part that is computed. Returns nothing if the cost is
/// unknown.
using CostOf = std::function<std::optional<Cost>(Invocation&)>;

/// Returns an estimate in proportion to a number of active voxels: those of all operands together
/// or those of the result, whichever is larger.
/// @param nanoseconds,bytes  CPU time, and memory beside operands and result, for each active voxel
/// @param perTriangle  nanoseconds for each triangle of a mesh; 0: the cost of meshes is not known
[[nodiscard]] CostOf costPerVoxel(double nanoseconds, double bytes = 0, double perTriangle = 0);

}  // namespace pipeline
