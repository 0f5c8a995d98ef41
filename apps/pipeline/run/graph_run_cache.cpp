#include "apps/pipeline/run/graph_run.h"

#include <algorithm>

#include "apps/pipeline/cache/cache_key.h"
#include "apps/pipeline/values/refusal.h"

namespace pipeline {

void GraphRun::useCache(const std::vector<char>& needed) {
  cache_.emplace(settings_.cache);
  keys_ = CacheKeys(*cache_, settings_.maxMemory).of(graph_, needed);
  const std::vector<std::size_t> uses = countUses(graph_, needed);
  std::vector<char> taken(graph_.nodes.size(), 0);
  for (const std::size_t result : graph_.results) taken[result] = 1;
  for (std::size_t i = graph_.nodes.size(); i-- > 0;) {
    const Node& node = graph_.nodes[i];
    if (!needed[i]) continue;
    const bool isKnown = keys_[i] && cache_->has(*keys_[i]);
    if (!node.makes()) {
      if (isKnown && isUpToDate(*keys_[i])) states_[i] = NodeState::UpToDate;
    } else if (!taken[i] && uses[i] > 0) {  // nodes take the value, but none of them runs; a value
                                            // that no node takes is a result of the run
      states_[i] = NodeState::UpToDate;
    } else if (isKnown && Cache::canHold(node.kind)) {
      states_[i] = NodeState::Load;
    }
    if (states_[i] != NodeState::Compute) continue;
    for (const std::size_t input : node.inputs) taken[input] = 1;
    for (const auto& [option, input] : node.named) taken[input] = 1;
  }
}

/// Decides if the files that a cached step wrote are unchanged.
bool GraphRun::isUpToDate(const std::string& key) const {
  const std::optional<CachedStep> step = cache_->step(key);
  return step && std::all_of(step->files.begin(), step->files.end(),
                             [](const FileStamp& file) { return stampOf(file.path) == file; });
}

/// Repeats the printed text of a cached node, and loads its value if a node takes it. Computes a
/// node whose cache entry is damaged.
void GraphRun::loadFromCache(std::size_t i) {
  if (!tryLoad(i)) compute(i);
}

/// Repeats the printed text of a cached node, and loads its value if a node takes it.
/// @return false: the cache entry is damaged
bool GraphRun::tryLoad(std::size_t i) {
  std::optional<Value> value;
  if (states_[i] == NodeState::Load) {
    try {
      value = cache_->value(*keys_[i], settings_.maxMemory);
    } catch (const levelset::Error& error) {
      rethrowAs(graph_.nodes[i].op->name, error, graph_.nodes[i].location);
    }
    if (!value) return false;
  }
  Thumbnail thumbnail;
  if (value) thumbnail = thumbnailFor(i, *value);
  const std::lock_guard lock(mutex_);
  StepReport& step = begin(i);
  step.isCached = true;
  step.thumbnail = std::move(thumbnail);
  std::string output;
  if (keys_[i])
    if (std::optional<CachedStep> known = cache_->step(*keys_[i])) {
      step.notes = std::move(known->notes);
      output = std::move(known->output);
    }
  if (value) {
    describeResult(*value, false, step);
    if (settings_.onValue) settings_.onValue(i, *value);
    values_.put(i, std::move(*value));
  }
  queueOutput(i, output);
  return true;
}

/// Stores a result for later runs. A result that failed a numeric check is not stored, so that a
/// later run reports the failure again.
void GraphRun::storeInCache(std::size_t i, const Invocation& invocation, const Value& value) {
  if (!cache_ || !keys_[i] || !invocation.notes.failure.empty()) return;
  const Node& node = graph_.nodes[i];
  CachedStep step{
      .action = node.op->name, .notes = invocation.notes, .output = invocation.output, .files = {}};
  if (node.op->targets)
    for (const std::string& target : node.op->targets(Invocation(*node.op, node.options))) {
      const std::optional<FileStamp> file = stampOf(target);
      if (!file) return;
      step.files.push_back(*file);
    }
  const bool isHeld = node.makes() && Cache::canHold(value.kind());
  const std::string failure = cache_->put(*keys_[i], step, isHeld ? &value : nullptr);
  if (failure.empty()) return;
  const std::lock_guard lock(mutex_);
  settings_.warn(failure);
}

}  // namespace pipeline
