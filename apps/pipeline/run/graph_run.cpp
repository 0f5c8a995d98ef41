#include "apps/pipeline/run/graph_run.h"

#include <fmt/core.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>

#include "apps/pipeline/values/refusal.h"
#include "levelset/error.h"

namespace pipeline {

GraphRun::GraphRun(const Graph& graph, const RunSettings& settings, RunReport& report)
    : graph_(graph),
      settings_(settings),
      report_(report),
      threads_(std::min(
          static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()),
          tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism))),
      running_(settings.measurePeaks),
      values_(decideStates()) {}

void GraphRun::run() {
  try {
    runNodes();
  } catch (...) {
    try {
      reportInOrder();
    } catch (const std::exception&) {
      // Ignored: the failure of the run is the one to report.
    }
    collectSteps();
    throw;
  }
  collectSteps();
}

Value GraphRun::runPart(std::size_t result) {
  values_.addUse(result);
  run();
  return values_.take(result);
}

void GraphRun::runNodes() {
  const auto count = [&](auto... states) {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < states_.size(); ++i)
      sum += !isGiven(i) && ((states_[i] == states) || ...);
    return sum;
  };
  const std::size_t known = count(NodeState::Load, NodeState::UpToDate),
                    ran = count(NodeState::Compute);
  planNodes();
  for (std::size_t i = 0; i < graph_.nodes.size(); ++i) {
    const Node& node = graph_.nodes[i];
    if (states_[i] == NodeState::Unneeded)
      report_.leftOut.push_back(node.op->name + (node.name.empty() ? "" : " @" + node.name));
    else if (const auto given = graph_.given.find(i); given != graph_.given.end())
      values_.put(i, given->second);
  }
  if (partedWrite_) return runInParts(*partedWrite_);
  const std::size_t all = graph_.nodes.size();
  ScheduleResult done{.isDone = std::vector<char>(all, 0)};
  if (threads_ > 1 && !settings_.dryRun && hasBranches()) done = scheduleTasks();
  runInOrder(done.isDone, done.failed.value_or(all));
  if (done.failure) std::rethrow_exception(done.failure);
  if (known > 0)
    settings_.note(
        ran == 0
            ? fmt::format("nothing was computed: all {} results come from an earlier run", known)
            : fmt::format("{} of {} results come from an earlier run", known, known + ran));
}

void GraphRun::runInOrder(const std::vector<char>& isDone, std::size_t end) {
  for (std::size_t i = 0; i < end; ++i) {
    reportInOrder();
    if (isDone[i] || isComputedForPlan_[i] || isGiven(i) || states_[i] == NodeState::Unneeded)
      continue;
    if (needsFullValues_[i]) requestFullValues(i);
    if (needsFullValues_[i] || states_[i] == NodeState::Compute)
      compute(i);
    else
      loadFromCache(i);
  }
  reportInOrder();
}

/// Sets the state of each node.
/// @return for each node, the number of nodes that run and take its value
std::vector<std::size_t> GraphRun::decideStates() {
  const std::size_t count = graph_.nodes.size();
  const std::vector<char> needed = neededNodes(graph_);
  isComputedForPlan_.resize(count);
  planningFailures_.resize(count);
  needsFullValues_.resize(count);
  regions_.resize(count);
  plans_.resize(count);
  steps_.resize(count);
  pendingOutput_.resize(count);
  states_.resize(count);
  for (std::size_t i = 0; i < count; ++i)
    states_[i] = needed[i] ? NodeState::Compute : NodeState::Unneeded;
  if (!settings_.cache.empty() && !settings_.dryRun) useCache(needed);
  std::vector<char> runs(count);
  for (std::size_t i = 0; i < count; ++i) runs[i] = states_[i] == NodeState::Compute;
  return countUses(graph_, runs);
}

StepReport& GraphRun::begin(std::size_t i) {
  const Node& node = graph_.nodes[i];
  StepReport step;
  if (steps_[i]) {  // a repeated step: its costs add up
    step.wallSeconds = steps_[i]->wallSeconds;
    step.cpuSeconds = steps_[i]->cpuSeconds;
    step.peakBytes = steps_[i]->peakBytes;
  }
  step.action = node.op->name;
  step.parameters = node.options;
  for (const Param& param : node.op->params)
    if (!param.fallback.empty() && !node.options.contains(param.name))
      step.defaults[param.name] = param.fallback;
  step.resultName = node.name;
  step.location = node.location;
  step.roi = regions_[i];
  return steps_[i].emplace(std::move(step));
}

void GraphRun::collectSteps() {
  for (std::size_t i = 0; i < std::min(steps_.size(), reportEnd_); ++i)
    if (steps_[i]) report_.steps.push_back(std::move(*steps_[i]));
}

Thumbnail GraphRun::thumbnailFor(std::size_t i, const Value& value) {
  if (settings_.thumbnails == 0) return {};
  if (i >= settings_.thumbnails)
    return {
        .png = {},
        .missing = fmt::format("only the first {} actions get a thumbnail", settings_.thumbnails)};
  Thumbnail thumbnail = thumbnailOf(value, settings_.maxMemory);
  running_.resetPeak();
  return thumbnail;
}

/// Stores the printed text of a finished node until its turn to be reported.
void GraphRun::queueOutput(std::size_t i, const std::string& output) {
  pendingOutput_[i] = output;
}

/// Reports finished nodes in the order of the graph, independent of which one ended first.
void GraphRun::reportInOrder() {
  for (; nextReported_ < std::min(states_.size(), reportEnd_); ++nextReported_) {
    const std::size_t i = nextReported_;
    if (isGiven(i) || states_[i] == NodeState::Unneeded) continue;
    if (!pendingOutput_[i]) return;
    const Node& node = graph_.nodes[i];
    StepNotes& notes = steps_[i]->notes;
    try {
      if (!pendingOutput_[i]->empty() && settings_.print) settings_.print(*pendingOutput_[i]);
    } catch (const levelset::Error& error) {
      rethrowAs(node.op->name, error, node.location);
    }
    for (const std::string& text : notes.warnings)
      settings_.warn(withLocation(sentenceOf(node.op->name, text), node.location));
    for (const std::string& text : notes.notes) settings_.note(sentenceOf(node.op->name, text));
    // The failure is thrown after the run, and the report lists it as a warning of its step.
    if (!notes.failure.empty()) notes.warnings.push_back(notes.failure);
  }
}

}  // namespace pipeline
