#pragma once

#include "apps/pipeline/registry/operator.h"

namespace pipeline {

/// The action `morph`, with --keep-steps, which writes a file for each step.
[[nodiscard]] Operator morphOperator();

}  // namespace pipeline
