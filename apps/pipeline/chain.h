#pragma once

#include <string>
#include <vector>

#include "apps/pipeline/graph.h"

namespace pipeline {

/// Reads `global options ACTION args ! ACTION …`, and checks all that can be told before anything
/// runs: actions, options, numbers, ranges, operands and their kinds, who writes standard output.
/// @throws levelset::UsageError
[[nodiscard]] Graph parseChain(const std::vector<std::string>& tokens);

}  // namespace pipeline
