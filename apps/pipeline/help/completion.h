#pragma once

#include <string>

namespace pipeline {

/// A script for bash or zsh, to be evaluated there, that completes actions, options, choices,
/// files, the names that --as gave, and the variables of scripts.
/// @throws levelset::UsageError for another shell
[[nodiscard]] std::string completionScript(const std::string& shell);

}  // namespace pipeline
