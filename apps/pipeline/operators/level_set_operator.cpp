#include "apps/pipeline/operators/level_set_operator.h"

#include <malloc.h>

#include <iterator>
#include <nlohmann/json.hpp>

namespace pipeline::detail {
namespace {

template <class T>
void append(std::vector<T>& all, std::vector<T>& more) {
  all.insert(all.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

std::string figuresJson(const levelset::Figures& figures) {
  nlohmann::ordered_json json;
  for (const auto& [key, figure] : figures)
    std::visit([&, name = key](const auto& one) { json[name] = one; }, figure);
  return json.dump();
}

}  // namespace

levelset::GivenOptions givenIn(const Invocation& in) {
  return {[&in](std::string_view name) { return in.given(std::string(name)); },
          !in.operands.empty() && in.operands[0].kind() == Kind::Mesh};
}

std::vector<ValuePlan> operandPlans(const Invocation& in) {
  std::vector<ValuePlan> plans;
  for (const Value& operand : in.operands) plans.push_back(operand.plan().estimate());
  return plans;
}

OperatorRun runOf(const Invocation& in) {
  OperatorRun run{
      .roi = in.roi, .isPartial = in.isPartial, .maxMemory = in.maxMemory, .progress = in.progress};
  if (in.planned) run.planned = in.planned->estimate();
  return run;
}

void releaseOperands(Invocation& in) {
  in.operands.clear();
  malloc_trim(0);  // the allocator keeps freed memory between the blocks in use
}

void fileNotes(levelset::OperatorRun& run, StepNotes& notes) {
  append(notes.notes, run.notes);
  append(notes.warnings, run.warnings);
  append(notes.errors, run.errors);
  if (!run.failure.empty()) notes.failure = run.failure;
  if (!run.figures.empty()) notes.detailsJson = figuresJson(run.figures);
  if (!run.certificate.empty()) notes.certificateJson = figuresJson(run.certificate);
}

}  // namespace pipeline::detail
