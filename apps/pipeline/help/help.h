#pragma once

#include <string>
#include <vector>

#include "apps/pipeline/registry/operator.h"

namespace pipeline {

struct HelpGroup {
  std::string name;
  std::vector<const Operator*> actions;
};

/// What help knows of: every action, and `run`.
[[nodiscard]] std::vector<HelpGroup> helpGroups();
/// The kinds of an action's operands, "mesh or level set, patch", or "none".
[[nodiscard]] std::string operandText(const Operator& op);

/// `help`: every action by group, the chain grammar, the global options.
[[nodiscard]] std::string helpOverview();
/// `help OP`
[[nodiscard]] std::string helpPage(const Operator& op);
/// `help OP --json`: the declaration as an object.
[[nodiscard]] std::string helpJson(const Operator& op);
/// `help --search WORD`: actions and options that mention it.
[[nodiscard]] std::string helpSearch(const std::string& word);

/// Answers the words behind `help`; those that other headers answer too. @throws
/// levelset::UsageError for an unknown action
[[nodiscard]] std::string help(const std::vector<std::string>& words);

}  // namespace pipeline
