#include "apps/pipeline/operators/kind_variant.h"

#include <optional>
#include <utility>

namespace pipeline {

bool isFirstOperand(Kind kind, const Invocation& in) {
  return !in.operands.empty() && in.operands[0].kind() == kind;
}

Operator withVariant(Operator op, KindVariant variant) {
  const Operator others = op;
  const auto applies = [kind = variant.kind](const Invocation& in) {
    return isFirstOperand(kind, in);
  };
  op.resultKind = [others, applies, kind = variant.kind](const Invocation& in) {
    return applies(in) ? kind : others.resultKind(in);
  };
  op.run = [others, applies, run = std::move(variant.run)](Invocation& in) {
    return applies(in) ? run(in) : others.run(in);
  };
  op.plan = [others, applies, keepsSize = variant.keepsSize](Invocation& in) {
    if (!applies(in)) return others.plan(in);
    Plan plan = in.operands[0].plan();
    for (const Value& operand : in.operands) plan.bounds.extendBy(operand.plan().bounds);
    if (!keepsSize) plan.fieldBytes = 0;  // unknown until the field is made
    return plan;
  };
  if (others.cost)
    op.cost = [others, applies](Invocation& in) {
      return applies(in) ? std::optional<Cost>() : others.cost(in);
    };
  if (others.regionOfInterest)
    op.regionOfInterest = [others, applies](Invocation& in, std::size_t operand,
                                            const levelset::RegionOfInterest& of) {
      return applies(in) ? levelset::RegionOfInterest{} : others.regionOfInterest(in, operand, of);
    };
  op.validate = [others, applies, any = std::move(variant.validateAny),
                 own = std::move(variant.validate)](const Invocation& in) {
    if (any) any(in);
    if (applies(in)) return own(in);
    others.validate(in);
  };
  return op;
}

}  // namespace pipeline
