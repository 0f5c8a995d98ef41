#pragma once

#include <string>
#include <vector>

#include "apps/pipeline/grammar/script.h"
#include "apps/pipeline/graph/graph.h"

namespace pipeline {

/// Reads `global options ACTION args ! ACTION …`, and checks all that can be told before anything
/// runs: actions, options, numbers, ranges, operands and their kinds, who writes standard output.
/// @throws levelset::UsageError
[[nodiscard]] Graph parseChain(const std::vector<std::string>& tokens);

/// The same of what a script comes to.
[[nodiscard]] Graph parseScript(const Script& script);

}  // namespace pipeline
