#pragma once

#include <string>

namespace pipeline {

/// Returns the text of docs/reference.md: every action by group, with operands, parameters and
/// example.
[[nodiscard]] std::string referencePage();

}  // namespace pipeline
