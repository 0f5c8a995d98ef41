#include "apps/pipeline/run/graph_run.h"

#include <cmath>
#include <new>

#include "apps/pipeline/run/planner.h"
#include "apps/pipeline/values/refusal.h"
#include "levelset/error.h"
#include "levelset/transform/crop.h"

namespace pipeline {
namespace {

/// Decides if a failure is caused by the input, as opposed to a memory limit, a cancellation or an
/// unknown exception.
bool isInputError(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const levelset::ResourceLimit&) {
    return false;
  } catch (const levelset::Cancelled&) {
    return false;
  } catch (const levelset::Error&) {
    return true;
  } catch (...) {
    return false;
  }
}

/// Puts the name of the action before the notes and warnings that do not have it.
void putActionBefore(const std::string& action, StepNotes& notes) {
  for (std::vector<std::string>* sentences : {&notes.notes, &notes.warnings})
    for (std::string& sentence : *sentences) sentence = sentenceOf(action, sentence);
  if (!notes.failure.empty()) notes.failure = sentenceOf(action, notes.failure);
}

/// Crops a band to a region of interest.
/// @throws levelset::NoSurface if the region contains no surface
Value cropTo(const Value& value, const RegionOfInterest& roi) {
  if (value.kind() != Kind::Band) return value;
  levelset::NarrowBand part = levelset::cropped(value.band(), roi);
  if (part.isEmpty() && !levelset::isEverywhere(roi.region))
    throw levelset::NoSurface(
        "no surface lies in the region of interest; use --no-roi to compute the complete value");
  return Value(std::move(part));
}

}  // namespace

/// Computes a node. Computes or loads its operands first if they are missing, as they are after a
/// damaged cache entry.
void GraphRun::compute(std::size_t i) {
  if (isGiven(i)) return values_.put(i, graph_.given.at(i));
  const Node& node = graph_.nodes[i];
  const bool isPlanned =
      states_[i] == NodeState::Compute;  // the uses of its operands are already counted
  // If the value is requested again after its release, it is loaded from the cache or computed
  // again.
  states_[i] = NodeState::UpToDate;
  if (!isPlanned) {
    for (const std::size_t input : node.inputs) values_.addUse(input);
    for (const auto& [option, input] : node.named) values_.addUse(input);
  }
  const auto bring = [&](std::size_t input) {
    if (values_.has(input)) return;
    if (cache_ && states_[input] == NodeState::UpToDate && keys_[input] &&
        Cache::canHold(graph_.nodes[input].kind) && cache_->has(*keys_[input]))
      states_[input] = NodeState::Load;
    if (states_[input] == NodeState::Load)
      loadFromCache(input);
    else
      compute(input);
  };
  for (const std::size_t input : node.inputs) bring(input);
  for (const auto& [option, input] : node.named) bring(input);
  try {
    runChecked(i, {}, nullptr);
  } catch (const RegionFailure&) {
    requestFullValues(i);
    compute(i);  // counts the uses of its operands again
  }
}

void GraphRun::runChecked(std::size_t i, const ContinueCheck& shouldContinue,
                          const ArenaCpu* arena) {
  const Node& node = graph_.nodes[i];
  if (planningFailures_[i]) {
    const std::lock_guard lock(mutex_);
    reportEnd_ = std::min(reportEnd_, i + 1);
    std::rethrow_exception(planningFailures_[i]);
  }
  StepReport& step = begin(i);
  StepClock clock(step, running_, arena);
  try {
    runNode(i, step, clock, shouldContinue);
  } catch (const std::bad_alloc&) {
    throw levelset::ResourceLimit(withLocation(
        node.op->name + ": memory ran out; use larger voxels or a narrower band", node.location));
  } catch (const levelset::Error& error) {
    rethrowAs(node.op->name, error, node.location);
  } catch (const std::exception& error) {
    if (!isThreadLimitError(error)) throw;
    throw levelset::ResourceLimit(withLocation(node.op->name + kThreadLimitMessage, node.location));
  }
}

Invocation GraphRun::invocationOf(std::size_t i, const ContinueCheck& shouldContinue) {
  const Node& node = graph_.nodes[i];
  Invocation invocation(*node.op, node.options);
  const std::lock_guard lock(mutex_);
  if (settings_.begin) settings_.begin(node.op->name);
  for (const std::size_t input : node.inputs) {
    invocation.operands.push_back(values_.take(input));
    invocation.operandNames.push_back(graph_.nodes[input].name);
  }
  for (const auto& [option, input] : node.named)
    invocation.named.emplace(option, values_.take(input));
  invocation.roi = regions_[i];
  invocation.planned = plans_[i];
  invocation.isPartial = !node.inputs.empty() && std::isfinite(regions_[node.inputs[0]].halfWidth);
  invocation.maxMemory = settings_.maxMemory;
  invocation.dryRun = settings_.dryRun;
  if (settings_.progress || settings_.shouldContinue || shouldContinue)
    invocation.progress = [this, i, &node, shouldContinue](double fraction) {
      if (settings_.progress) settings_.progress(i, node.op->name, fraction);
      return (!shouldContinue || shouldContinue()) &&
             (!settings_.shouldContinue || settings_.shouldContinue());
    };
  return invocation;
}

/// Runs the operator of a node, or its plan in a dry run.
/// @throws RegionFailure if the node may succeed on complete values; otherwise the operator's error
void GraphRun::runNode(std::size_t i, StepReport& step, StepClock& clock,
                       const ContinueCheck& shouldContinue) {
  const Node& node = graph_.nodes[i];
  const Operator& op = *node.op;
  Invocation invocation = invocationOf(i, shouldContinue);
  const auto finish = [&](const Value* value, bool isRefused = false) {
    const std::lock_guard lock(mutex_);
    if (isRefused) reportEnd_ = std::min(reportEnd_, i + 1);
    if (value && settings_.onValue) settings_.onValue(i, *value);
    if (value) values_.put(i, *value);
    putActionBefore(op.name, invocation.notes);
    step.notes = invocation.notes;
    queueOutput(i, invocation.output);
  };
  try {
    if (settings_.dryRun) {
      const Plan plan = planOf(invocation);
      invocation.resolveLengths();
      levelset::requireMemory(plan.bytes(), settings_.maxMemory);
      const Value value(plan);
      if (node.makes()) describeResult(value, true, step);
      clock.stop();
      finish(node.makes() ? &value : nullptr);
    } else {
      Value value = op.run(invocation);
      putActionBefore(op.name, invocation.notes);  // the cache stores the notes in this form
      if (!regions_[i].isWhole()) value = cropTo(value, regions_[i]);
      if (node.makes()) describeResult(value, false, step);
      clock.stop();
      if (node.makes() && settings_.measureErrors)
        estimateError(value, invocation, invocation.notes);
      storeInCache(i, invocation, value);
      if (node.makes()) step.thumbnail = thumbnailFor(i, value);
      finish(node.makes() ? &value : nullptr);
    }
  } catch (...) {
    clock.stop();
    if (!isPart() && isRestricted(i) && isInputError(std::current_exception()))
      throw RegionFailure();
    finish(nullptr, true);
    throw;
  }
}

}  // namespace pipeline
