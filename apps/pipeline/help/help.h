#pragma once

#include <string>
#include <vector>

#include "apps/pipeline/registry/operator.h"

namespace pipeline {

struct HelpGroup {
  std::string name;
  std::vector<const Operator*> actions;
};

/// Returns the groups of the help, which contain every action and `run`.
[[nodiscard]] std::vector<HelpGroup> helpGroups();
/// Returns the kinds of an action's operands, "mesh or level set, patch", or "none".
[[nodiscard]] std::string operandText(const Operator& op);

/// Page of `help`: every action by group, the grammar of chains, the global options.
[[nodiscard]] std::string helpOverview();
/// Page of `help ACTION`.
[[nodiscard]] std::string helpPage(const Operator& op);
/// Page of `help ACTION --json`: the declaration of the action as a JSON object.
[[nodiscard]] std::string helpJson(const Operator& op);
/// Page of `help --search WORD`: actions and options that mention the word.
[[nodiscard]] std::string helpSearch(const std::string& word);

/// Returns the page that `help` prints for the words after it.
/// @throws levelset::UsageError for an unknown action
[[nodiscard]] std::string help(const std::vector<std::string>& words);

}  // namespace pipeline
