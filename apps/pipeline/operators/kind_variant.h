#pragma once

#include <functional>

#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/registry/operator.h"

namespace pipeline {

/// Behaviour of an action whose first operand is of a further kind. The result is of that kind too.
struct KindVariant {
  Kind kind;
  std::function<Value(Invocation&)> run;
  std::function<void(const Invocation&)> validate;
  /// Check before those of all variants, for operands of any kind.
  std::function<void(const Invocation&)> validateAny = {};
  bool keepsSize = false;  ///< the result takes about the memory of the first operand
};

/// Returns true if the first operand is of a kind.
[[nodiscard]] bool isFirstOperand(Kind kind, const Invocation& in);

/// Lets an action take a further kind as its first operand. Such an action has no cost and no
/// region of interest.
[[nodiscard]] Operator withVariant(Operator op, KindVariant variant);

}  // namespace pipeline
