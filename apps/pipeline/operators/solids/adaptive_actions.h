#pragma once

#include <functional>

#include "apps/pipeline/registry/operator.h"

/// Adaptive fields as operands and results of actions.
namespace pipeline {

/// Refuses operands of which some are adaptive fields and some are not.
void requireOneKind(const Invocation& in);

/// Extends `level-set` by --adaptive, which makes an adaptive field of a mesh or a level set.
[[nodiscard]] Operator withAdaptiveResult(Operator levelSet);

/// Lets an action on level sets take adaptive fields too. The result is then an adaptive field.
/// @param names  options that adaptive fields need; others are refused
[[nodiscard]] Operator alsoOfAdaptive(Operator op, std::vector<std::string> names,
                                      std::function<Value(Invocation&)> run);

[[nodiscard]] Operator unionOperator();
[[nodiscard]] Operator intersectionOperator();
[[nodiscard]] Operator differenceOperator();
[[nodiscard]] Operator offsetOperator();
[[nodiscard]] Operator toBandOperator();

}  // namespace pipeline
