#pragma once

#include <functional>
#include <optional>

#include "apps/pipeline/values/value.h"
#include "levelset/operator/cost.h"

namespace pipeline {

class Invocation;

using levelset::Cost;

/// Its operands are plans of what is read, and Invocation::planned that of what is made. Empty
/// where it cannot be told.
using CostOf = std::function<std::optional<Cost>(Invocation&)>;

/// For each active voxel of bands, the operands together or the result, whichever are more.
/// @param perTriangle  nanoseconds, of meshes; 0: not known. Nor is it of other values
[[nodiscard]] CostOf costPerVoxel(double nanoseconds, double bytes = 0, double perTriangle = 0);

/// Grid points of a layer one voxel thick all along the surface of a band.
[[nodiscard]] double layerOf(const Plan& band);

/// Of distances made again of a band.
/// @param layer      of the surface that they are distances to
/// @param halfWidth  of the result, voxels
[[nodiscard]] Cost costOfDistances(double layer, double halfWidth);

/// Of a surface that is moved.
/// @param before,after  layers of the two surfaces
/// @param way           voxels
/// @param halfWidth     of the result, voxels
[[nodiscard]] Cost costOfOffset(double before, double after, double way, double halfWidth);

}  // namespace pipeline
