#pragma once

#include "apps/pipeline/registry/operator.h"

/// The action `deform`: solids, meshes and point clouds through a lattice of control points.
namespace pipeline {

[[nodiscard]] Operator deformOperator();

}  // namespace pipeline
