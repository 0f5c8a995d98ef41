#include "apps/pipeline/run/graph_run.h"

#include <tbb/task_arena.h>

#include <algorithm>

namespace pipeline {
namespace {

/// Decides if a node has effects beside its value, or depends on more than its operands.
bool hasSideEffects(const Node& node) {
  const Operator& op = *node.op;
  if (!node.makes() || !op.isRepeatable) return true;
  const Invocation probe(op, node.options);
  return (op.targets && !op.targets(probe).empty()) ||
         (op.usesStandardInput && op.usesStandardInput(probe)) ||
         (op.usesStandardOutput && op.usesStandardOutput(probe));
}

}  // namespace

/// Decides if any node can run concurrently with the node before it.
bool GraphRun::hasBranches() const {
  std::optional<std::size_t> before;
  for (std::size_t i = 0; i < graph_.nodes.size(); ++i) {
    if (states_[i] == NodeState::Unneeded || isGiven(i)) continue;
    const Node& node = graph_.nodes[i];
    const auto& inputs = node.inputs;
    const bool takesPrevious =
        before && std::find(inputs.begin(), inputs.end(), *before) != inputs.end();
    if (before && !takesPrevious && !hasSideEffects(node)) return true;
    before = i;
  }
  return false;
}

std::vector<Task> GraphRun::tasks() const {
  std::vector<char> needed(graph_.nodes.size());
  for (std::size_t i = 0; i < needed.size(); ++i) needed[i] = states_[i] != NodeState::Unneeded;
  const auto writers = findWritersRead(graph_, needed);
  std::vector<Task> tasks(graph_.nodes.size());
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    if (!needed[i] || isGiven(i)) continue;
    const Node& node = graph_.nodes[i];
    tasks[i].isBarrier = hasSideEffects(node);
    if (writers[i]) tasks[i].dependencies.push_back(*writers[i]);
    if (states_[i] != NodeState::Compute) continue;
    for (const std::size_t input : node.inputs) tasks[i].dependencies.push_back(input);
    for (const auto& [option, input] : node.named) tasks[i].dependencies.push_back(input);
  }
  return tasks;
}

ScheduleResult GraphRun::scheduleTasks() {
  SchedulerSettings settings{.threads = threads_};
  settings.run = [&](std::size_t i, const ContinueCheck& shouldContinue) {
    const bool isDone = runTask(i, shouldContinue);
    const std::lock_guard lock(mutex_);
    if (isDone) reportInOrder();
    return isDone;
  };
  settings.mayStart = [&](std::size_t i, const std::vector<std::size_t>& running) {
    const std::lock_guard lock(mutex_);
    return fitsInMemory(i, running);
  };
  return pipeline::scheduleTasks(tasks(), settings);
}

/// Runs a node as a task of the scheduler.
/// @return false: the node must run later, without concurrent tasks
bool GraphRun::runTask(std::size_t i, const ContinueCheck& shouldContinue) {
  NodeState state = NodeState::Unneeded;
  {
    const std::lock_guard lock(mutex_);
    state = states_[i];
    if (state == NodeState::Unneeded || isComputedForPlan_[i] || isGiven(i)) return true;
    const Node& node = graph_.nodes[i];
    const auto isAvailable = [&](std::size_t input) { return values_.has(input); };
    if (state == NodeState::Compute &&
        !(std::all_of(node.inputs.begin(), node.inputs.end(), isAvailable) &&
          std::all_of(node.named.begin(), node.named.end(),
                      [&](const auto& named) { return isAvailable(named.second); })))
      return false;
    if (state == NodeState::Compute) states_[i] = NodeState::UpToDate;
  }
  if (state != NodeState::Compute) return tryLoad(i);
  tbb::task_arena arena(static_cast<int>(threads_));
  const ArenaCpu cpu(arena);
  try {
    arena.execute([&] { runChecked(i, shouldContinue, &cpu); });
  } catch (const RegionFailure&) {
    const std::lock_guard lock(mutex_);
    needsFullValues_[i] = 1;
    return false;
  }
  return true;
}

}  // namespace pipeline
