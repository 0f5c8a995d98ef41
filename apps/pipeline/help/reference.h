#pragma once

#include <string>

namespace pipeline {

/// docs/reference.md: every action by group, with its operands, parameters and example.
[[nodiscard]] std::string referencePage();

}  // namespace pipeline
