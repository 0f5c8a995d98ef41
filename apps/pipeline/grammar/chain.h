#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/grammar/script.h"
#include "apps/pipeline/graph/graph.h"

namespace pipeline {

/// Parses a command line `GLOBAL-OPTIONS ACTION ARGUMENTS ! ACTION …` into a graph. Checks actions,
/// options, numbers, ranges, operands and their kinds, and the use of standard input and output.
/// @throws levelset::UsageError
[[nodiscard]] Graph parseChain(const std::vector<std::string>& tokens);

/// Parses an expanded script into a graph, with the same checks.
[[nodiscard]] Graph parseScript(const Script& script);

/// Finds `--help` or `-h` in a chain. Returns the action before it, or an empty text before the
/// first action; an empty value without such a word.
[[nodiscard]] std::optional<std::string> helpRequest(const std::vector<std::string>& tokens);

}  // namespace pipeline
