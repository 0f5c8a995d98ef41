#pragma once

#include "apps/pipeline/registry/operator.h"

namespace pipeline {

/// Lets `animate` take its first operand alone, and move it by control points between key frames:
/// a level set, a mesh or a point cloud by --lattices or --cages, a scene with a Bézier volume by
/// --beziers.
[[nodiscard]] Operator withControlPoints(Operator animate);

}  // namespace pipeline
