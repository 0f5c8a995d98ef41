#pragma once

#include <map>
#include <string>
#include <vector>

#include "apps/pipeline/operator.h"

namespace pipeline {

/// One action as it was written, its parameters checked.
struct Action {
  const Operator* op = nullptr;
  std::map<std::string, std::string> options;  ///< by full name; a flag is "true"
  std::vector<std::string> operandNames;       ///< `@NAME`, without the @
  std::map<std::string, std::string> named;    ///< option to the name in its `@NAME`
  std::string resultName;                      ///< --as
  std::string place;                           ///< where it stood, if in a script
};

struct Chain {
  std::map<std::string, std::string> globals;
  std::vector<Action> actions;
  bool isFromStandardInput = false;  ///< the script was `-`
};

/// Splits `global options ACTION args ! ACTION …`, and checks all that can be told before anything
/// runs: actions, options, numbers, ranges, operands and their kinds, who writes standard output.
/// @throws levelset::UsageError
[[nodiscard]] Chain parseChain(const std::vector<std::string>& tokens);

}  // namespace pipeline
