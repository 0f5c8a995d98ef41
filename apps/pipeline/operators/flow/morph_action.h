#pragma once

#include "apps/pipeline/registry/operator.h"

namespace pipeline {

/// The action `morph`, with the additional option --keep-steps, which writes a file for each step.
[[nodiscard]] Operator morphOperator();

}  // namespace pipeline
