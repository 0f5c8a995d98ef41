#pragma once

#include <string>

namespace pipeline {

/// Returns a script for bash or zsh that completes actions, options, choices, files, names of --as,
/// and variables of scripts. The shell evaluates it.
/// @throws levelset::UsageError for another shell
[[nodiscard]] std::string completionScript(const std::string& shell);

}  // namespace pipeline
