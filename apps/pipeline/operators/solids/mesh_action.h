#pragma once

#include "apps/pipeline/registry/operator.h"

namespace pipeline {

/// The action `mesh`, for level sets and patches.
[[nodiscard]] Operator meshOperator();

}  // namespace pipeline
