#pragma once

#include "apps/pipeline/registry/operator.h"

namespace pipeline {

/// `mesh`, of level sets and of patches.
[[nodiscard]] Operator meshOperator();

}  // namespace pipeline
