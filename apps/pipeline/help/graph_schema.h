#pragma once

#include <string>

namespace pipeline {

/// A JSON Schema (draft 2020-12) of the files that graphFromJson() reads: each action with its
/// options. That inputs come before what takes them, and of which kinds they are, it cannot tell.
[[nodiscard]] std::string graphSchema();

}  // namespace pipeline
