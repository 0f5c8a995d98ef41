#pragma once

#include <string>

namespace pipeline {

/// Returns a JSON Schema (draft 2020-12) of the files that graphFromJson() reads: each action with
/// its options. The schema checks neither the order of nodes nor the kinds of operands.
[[nodiscard]] std::string graphSchema();

}  // namespace pipeline
