#pragma once

#include <string>
#include <vector>

#include "apps/pipeline/operator.h"

namespace pipeline {

/// `help`: every action by group, the chain grammar, the global options.
[[nodiscard]] std::string helpOverview();
/// `help OP`
[[nodiscard]] std::string helpPage(const Operator& op);
/// `help OP --json`: the declaration as an object.
[[nodiscard]] std::string helpJson(const Operator& op);
/// `help --search WORD`: actions and options that mention it.
[[nodiscard]] std::string helpSearch(const std::string& word);

/// Answers the words behind `help`. @throws levelset::UsageError for an unknown action
[[nodiscard]] std::string help(const std::vector<std::string>& words);

}  // namespace pipeline
