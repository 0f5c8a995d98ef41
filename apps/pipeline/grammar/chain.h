#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/grammar/script.h"
#include "apps/pipeline/graph/graph.h"

namespace pipeline {

/// Parses a command line `GLOBAL-OPTIONS ACTION ARGUMENTS ! ACTION …` into a graph. Checks actions,
/// options, numbers, ranges, operands and their kinds, and the use of standard input and output.
/// @throws levelset::UsageError if a check fails; for `run FILE`, also the errors of readScript()
///         and readGraph()
[[nodiscard]] Graph parseChain(const std::vector<std::string>& tokens);

/// Parses an expanded script into a graph, with the checks of parseChain().
[[nodiscard]] Graph parseScript(const Script& script);

/// Finds the first `--help` or `-h` on a command line.
/// @return name of the action before it; an empty string if it stands before the first action; no
///         value if there is no such word
[[nodiscard]] std::optional<std::string> helpRequest(const std::vector<std::string>& tokens);

}  // namespace pipeline
