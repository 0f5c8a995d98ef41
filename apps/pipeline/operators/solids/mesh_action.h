#pragma once

#include "apps/pipeline/registry/operator.h"

namespace pipeline {

/// The action `mesh`, for level sets, patches and other values with a surface.
[[nodiscard]] Operator meshOperator();

}  // namespace pipeline
